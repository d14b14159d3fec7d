// Rays from the eye through places of the image, row 0 at the top. If the eye is far outside the scene's
// sphere, rays start nearer, as in rays/far_origins.py. A picture needs no t. The rounding of the start
// moves a ray less than the rounding of the direction does.

uniform vec3 eye;
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;
uniform vec3 centre;    // centre of the scene's sphere
uniform float beyond;   // rays start this far before the centre; 0 where the eye is near

// ``place`` in pixels, (0, 0) the image's corner.
Rays eye_ray(vec2 place) {
    vec2 at = 2.0 * place / size - 1.0;
    vec3 direction = normalize(forward + at.x * right - at.y * up);
    float ahead = beyond > 0.0 ? max(dot(centre - eye, direction) - beyond, 0.0) : 0.0;
    return Rays(eye + ahead * direction, 0.0, direction, INFINITE);
}
