#version 330 core
// Sends the work of an element to the element's ray, where blending adds the work up.

#include <sources>
#include "core/fetch.glsl"

uniform ivec2 size;   // size of the rays' texture

flat out vec3 did;

void main() {
    ivec2 element = table_texel(gl_VertexID);
#ifdef LEAVES
    Tested at = tested_load(element);
    did = vec3(0.0, 1.0, float(met_load(element).tests));
#else
    Visited at = visited_load(element);
    did = vec3(values_load(element).value.w, 0.0, 0.0);
#endif
    vec2 clip = 2.0 * (vec2(at.x, at.y) + 0.5) / vec2(size) - 1.0;
    gl_Position = did == vec3(0.0) ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(clip, 0.0, 1.0);
}
