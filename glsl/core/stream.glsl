// The stream element of a fragment. Streams wrap in rows as tables do.

#include "core/fetch.glsl"

uniform int last_element;   // index of the last element drawn

// A renderer runs fragments in blocks of four and discards the results of fragments beyond the stream.
// These fragments process the last element again. With undefined data their loops might never end. A
// renderer that limits iterations would then also stop the loops of the neighbouring fragments.
int element() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    return min(texel.x + (texel.y << TABLE_WIDTH_LOG2), last_element);
}
