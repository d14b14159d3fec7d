// Light sampling at a vertex of a path. Choose a light by Walker's alias method (1977), from the table of
// gpgpu_rt/scene/light_choice.py. Then choose a point on this light. For the scene's surroundings,
// asked_surroundings.glsl chooses a direction instead.

uniform int light_count;
uniform float light_density;   // (density of sampled points per area) / (luminance of their emission)

struct AskedLight {
    vec3 place;
    vec3 normal;        // normal of a triangle; zero for a point light
    vec3 strength;      // radiance of a triangle; for a point light, irradiance / the light's probability
    float blur;         // bound on the error of `place`, along the normal
    bool far;           // whether the light is the surroundings of the scene
};

AskedLight ask_light(vec4 random) {
    int entry = min(int(random.x * float(light_count)), light_count - 1);
    int light = random.y < light_choice_keep(entry) ? light_choice_light(entry)
                                                    : light_choice_alias(entry);
    AskedLight asked = AskedLight(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, false);
#ifdef ASKED_SURROUNDINGS
    asked.far = light == far_light;
#endif
#ifdef POINT_LIGHTS
    if (light < 0 && !asked.far) {
        asked.place = point_light_position(-1 - light);
        asked.strength = point_light_strength(-1 - light);
    }
#endif
#ifdef AREA_LIGHTS
    if (light >= 0) {
        vec3 v0 = triangle_v0(light);
        vec3 edge_u = triangle_v1(light) - v0;
        vec3 edge_v = triangle_v2(light) - v0;
        vec2 uv = sample_triangle(random.zw);
        asked.place = v0 + uv.x * edge_u + uv.y * edge_v;
        asked.normal = normalize(cross(edge_u, edge_v));
#ifdef MATERIALS
        asked.strength = emission_radiance(surface_material(light));
#else
        asked.strength = emission_radiance(only_material);
#endif
        asked.blur = place_error(asked.place, edge_u, edge_v);
    }
#endif
    return asked;
}
