// Rays from the eye through places of the image, row 0 at the top. If the eye is far outside the sphere
// around the scene, rays start nearer to the scene (gpgpu_rt/rays/far_origins.py). Then t is the distance
// from this start and not from the eye. This does no harm, because a picture does not use t.

uniform vec3 eye;
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;
uniform vec3 centre;    // centre of the sphere around the scene
uniform float beyond;   // distance from a ray's start to its point nearest to `centre`; 0: start at the eye

// The eye ray through a place of the image. `place` is in pixels from the upper left corner.
Rays eye_ray(vec2 place) {
    vec2 at = 2.0 * place / size - 1.0;
    vec3 direction = normalize(forward + at.x * right - at.y * up);
    float ahead = beyond > 0.0 ? max(dot(centre - eye, direction) - beyond, 0.0) : 0.0;
    return Rays(eye + ahead * direction, 0.0, direction, INFINITE);
}
