// Looks up an image bilinearly; the image is a rectangle of a texture. Texture coordinates (0, 0) are the
// lower left corner, row 0 is the uppermost row, and the image repeats. `Texture.sample` in
// gpgpu_rt/scene/texture.py is the numpy version.

vec3 image_at(sampler2D images, ivec2 corner, ivec2 size, vec2 uv) {
    vec2 at = vec2(fract(uv.x), 1.0 - fract(uv.y)) * vec2(size) - 0.5;
    vec2 first = floor(at);
    vec2 part = at - first;
    ivec2 lo = ivec2(first);
    ivec2 hi = lo + 1;
    // Wrap the coordinates, which lie at most one texel outside the image. Do not use the operator %, which
    // GLSL does not define for negative numbers.
    lo = corner + ivec2(lo.x < 0 ? size.x - 1 : lo.x, lo.y < 0 ? size.y - 1 : lo.y);
    hi = corner + ivec2(hi.x >= size.x ? 0 : hi.x, hi.y >= size.y ? 0 : hi.y);
    vec3 upper = mix(texelFetch(images, lo, 0).rgb,
                     texelFetch(images, ivec2(hi.x, lo.y), 0).rgb, part.x);
    vec3 lower = mix(texelFetch(images, ivec2(lo.x, hi.y), 0).rgb,
                     texelFetch(images, hi, 0).rgb, part.x);
    return mix(upper, lower, part.y);
}
