// Refract light at both borders, front and back, of a closed mesh (Wyman 2005; see
// image_space/refraction_front.frag).

uniform sampler2D back_faces;    // normals, and distances from the eye
uniform float ior;

const float LEFT = 1.0;          // kinds of exits, as in gpgpu_rt/render/image_space/refraction.py
const float UNSEEN = 2.0;        // the exit lies outside the image of the back faces
const float TOTAL = 3.0;         // total reflection at one of the two borders

struct Through {
    vec3 exit;         // exit point
    vec3 inside;       // unit direction between the borders
    vec3 outside;      // unit direction behind the second border
    vec3 normal;       // outward normal of the second border
    float kind;
};

Through through_both(vec3 place, vec3 normal, float inward) {
    vec3 view = normalize(place - eye);
    float cosine = clamp(-dot(view, normal), 0.0, 1.0);
    vec3 inside = refract(view, normal, 1.0 / ior);
    if (inside == vec3(0.0)) {    // total reflection at the first border, for ior < 1
        vec3 back = reflect(view, normal);
        return Through(place, back, back, normal, TOTAL);
    }
    float entering = acos(cosine);
    float refracted = acos(clamp(-dot(inside, normal), 0.0, 1.0));
    float share = entering > 1e-3 ? refracted / entering : 1.0 / ior;
    float far = texelFetch(back_faces, ivec2(gl_FragCoord.xy), 0).w;
    float along = far > 0.0 ? max(far - distance(place, eye), 0.0) : inward;
    vec3 exit = place + mix(inward, along, share) * inside;
    vec4 seen_at = clip_place(exit);
    ivec2 pixel = ivec2(floor((seen_at.xy / seen_at.w * 0.5 + 0.5) * size));
    bool seen = min(pixel.x, pixel.y) >= 0 && pixel.x < int(size.x) && pixel.y < int(size.y);
    vec4 back = seen ? texelFetch(back_faces, pixel, 0) : vec4(0.0);
    if (back.w == 0.0) {
        return Through(exit, inside, inside, normal, UNSEEN);
    }
    vec3 outside = refract(inside, -back.xyz, ior);
    bool total = outside == vec3(0.0);
    return Through(exit, inside, total ? reflect(inside, -back.xyz) : outside, back.xyz,
                   total ? TOTAL : LEFT);
}
