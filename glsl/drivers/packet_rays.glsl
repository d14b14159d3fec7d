// The rays of a fragment's packet, and their hits.

uniform ivec2 ray_texture_size;
uniform int most_steps;
int step_limit = max(most_steps, 0);   // read once, for the reason given in core/quantised.glsl

// EACH(f) calls f(0), f(1), ...: constant indices keep the arrays in registers.
Ray rays[RAYS];
Hit hits[RAYS];
int rows[RAYS];   // each ray's hit, as a row of the triangle table, or NO_TRIANGLE; the compiler removes
                  // the array if no render target holds it (drivers/targets_rows.glsl)
int steps = 0;
int tested;       // the row that EACH(test_ray) tests

void test_ray(int r) {
    Hit hit = hits[r];
    test_triangle(rays[r], tested, hit);
    hit.t = stored(hit.t);
    rows[r] = hit.triangle != hits[r].triangle ? tested : rows[r];
    hits[r] = hit;
}

ivec2 ray_texel(int r) {
    return ivec2(gl_FragCoord.xy) * PACKET_SIZE + ivec2(r % PACKET_WIDTH, r / PACKET_WIDTH);
}

// Load ray r. A ray beyond the edge of the ray textures gets an empty interval.
void load(int r) {
    ivec2 texel = ray_texel(r);
    bool inside = texel.x < ray_texture_size.x && texel.y < ray_texture_size.y;
    Rays texels = rays_load(min(texel, ray_texture_size - 1));
    texels.t_max = inside ? texels.t_max : -1.0;
    texels.t_min = inside ? texels.t_min : 1.0;
    rays[r] = ray_setup(texels);
    hits[r] = no_hit(stored(rays[r].t_max));
    rows[r] = NO_TRIANGLE;
}
