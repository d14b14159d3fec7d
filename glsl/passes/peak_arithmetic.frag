#version 330 core
// The roofline's arithmetic (gpgpu_rt/bench/roofline.py): TURNS multiply-adds of each of four
// vectors that do not wait for each other.

uniform float factor;

out vec4 sum;

void main() {
    vec4 a = gl_FragCoord;
    vec4 b = a + 1.0;
    vec4 c = a + 2.0;
    vec4 d = a + 3.0;
    for (int turn = 0; turn < TURNS; ++turn) {
        a = a * factor + b;
        b = b * factor + c;
        c = c * factor + d;
        d = d * factor + a;
    }
    sum = a + b + c + d;
}
