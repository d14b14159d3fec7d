// Luminance of linear RGB, with the same weights as gpgpu_rt/scene/luminance.py.

float luminance(vec3 colour) {
    return dot(colour, vec3(0.2126, 0.7152, 0.0722));
}
