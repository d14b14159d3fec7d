// Sample directions towards an image around the scene, with a density proportional to the image's
// brightness. gpgpu_rt/scene/image_light.py is the numpy version and documents the algorithm. Include this
// file after surroundings.glsl, sample.glsl and luminance.glsl.

uniform sampler2D surroundings_sums;    // cumulative probabilities of the cells of each row

// A direction's probability density (per steradian) is image_density * luminance * (mean cosine of latitude
// in the direction's row of cells) / (cosine of the direction's latitude). A cell is the square between
// four pixel centres. The density includes the probability that light sampling chooses the image.
uniform float image_density;

struct FarLight {
    vec3 direction;
    vec3 radiance;
    float bright;       // density of the direction, times the cosine of its latitude
};

// The density of a direction times the cosine of its latitude, given the radiance in this direction.
float image_bright(int row, vec3 radiance) {
    return image_density * luminance(radiance) * surroundings_row_cosine(row);
}

float image_bright(vec3 direction, vec3 radiance) {
    int height = textureSize(surroundings_image, 0).y;
    float down = (1.0 - surroundings_uv(direction).y) * float(height);
    return image_bright(clamp(int(floor(down + 0.5)), 0, height), radiance);
}

float cell_sum(int row, int column) {
    return texelFetch(surroundings_sums, ivec2(column, row), 0).r;
}

// Sample a position in [0, 1] with a density that changes linearly from `here` to `there`.
float sample_linear(float here, float there, float random) {
    float root = sqrt(mix(here * here, there * there, random));
    return random * (here + there) / max(here + root, 1e-30);
}

FarLight ask_image(vec2 random) {
    ivec2 size = textureSize(surroundings_image, 0);
    int row = 0;
    for (int last = size.y; row < last;) {
        int middle = (row + last) / 2;
        bool before = random.x < surroundings_row_sum(middle);
        last = before ? middle : last;
        row = before ? row : middle + 1;
    }
    int column = 0;
    for (int last = size.x - 1; column < last;) {
        int middle = (column + last) / 2;
        bool before = random.y < cell_sum(row, middle);
        last = before ? middle : last;
        column = before ? column : middle + 1;
    }
    vec2 below = vec2(column > 0 ? cell_sum(row, column - 1) : 0.0,
                      row > 0 ? surroundings_row_sum(row - 1) : 0.0);
    vec2 sums = vec2(cell_sum(row, column), surroundings_row_sum(row));
    vec2 part = (random.yx - below) / (sums - below);
    int left = column > 0 ? column - 1 : size.x - 1;
    int top = max(row - 1, 0);
    int bottom = min(row, size.y - 1);
    vec3 upper[2] = vec3[2](texelFetch(surroundings_image, ivec2(left, top), 0).rgb,
                            texelFetch(surroundings_image, ivec2(column, top), 0).rgb);
    vec3 lower[2] = vec3[2](texelFetch(surroundings_image, ivec2(left, bottom), 0).rgb,
                            texelFetch(surroundings_image, ivec2(column, bottom), 0).rgb);
    part.y = sample_linear(luminance(upper[0] + upper[1]), luminance(lower[0] + lower[1]), part.y);
    vec3 ends[2] = vec3[2](mix(upper[0], lower[0], part.y), mix(upper[1], lower[1], part.y));
    part.x = sample_linear(luminance(ends[0]), luminance(ends[1]), part.x);
    vec3 radiance = mix(ends[0], ends[1], part.x);
    // Compute sine and cosine of half the latitude and of a quarter of the longitude, because the
    // polynomials are accurate for small angles. Then double the angles.
    float first = max(float(row) - 0.5, 0.0);
    float last = min(float(row) + 0.5, float(size.y));
    vec2 up = sine_and_cosine(SAMPLE_PI * (0.25 - 0.5 * mix(first, last, part.y) / float(size.y)));
    vec2 turn = sine_and_cosine(SAMPLE_PI * (0.5 * (float(column) - 0.5 + part.x) / float(size.x)
                                             - 0.25));
    up = twice_the_angle(up);
    turn = twice_the_angle(twice_the_angle(turn));
    return FarLight(vec3(up.y * turn.x, up.x, -up.y * turn.y), radiance,
                    image_bright(row, radiance));
}
