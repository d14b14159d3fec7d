// Loop over the rays of the fragment's tile: TILE x TILE rays, fewer at the edges of the ray texture.

uniform ivec2 ray_texture_size;

#define FOR_RAYS_OF_TILE(pixel) \
    ivec2 tile_lo = TILE * ivec2(gl_FragCoord.xy); \
    ivec2 tile_hi = min(tile_lo + TILE, ray_texture_size); \
    for (ivec2 pixel = tile_lo; pixel.y < tile_hi.y; \
         pixel = pixel.x + 1 < tile_hi.x ? ivec2(pixel.x + 1, pixel.y) \
                                         : ivec2(tile_lo.x, pixel.y + 1))
