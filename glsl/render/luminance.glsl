// Luminance of linear RGB. The twin: gpgpu_rt/scene/luminance.py.

float luminance(vec3 colour) {
    return dot(colour, vec3(0.2126, 0.7152, 0.0722));
}
