// The angle between a 2D vector and the x axis, in (-pi, pi], with an error of 1e-7. A driver's own inverse
// functions may have errors of 1e-4 or more, which would shift an image of the sky.
float angle_of(vec2 at) {
    vec2 size = abs(at);
    float most = max(size.x, size.y);
    float slope = min(size.x, size.y) / max(most, 1e-30);
    bool steep = slope > 0.41421356;     // the tangent of pi / 8
    float x = steep ? (slope - 1.0) / (slope + 1.0) : slope;
    float y = x * x;
    float angle = x * (1.0 - y * (1.0 / 3.0 - y * (1.0 / 5.0 - y * (1.0 / 7.0 - y * (1.0 / 9.0
                - y * (1.0 / 11.0 - y * (1.0 / 13.0 - y / 15.0)))))));
    angle = steep ? angle + 0.78539816 : angle;
    angle = size.y > size.x ? 1.57079633 - angle : angle;
    angle = at.x < 0.0 ? 3.14159265 - angle : angle;
    return at.y < 0.0 ? -angle : angle;
}
