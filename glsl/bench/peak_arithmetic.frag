#version 330 core
// Measures the rate of multiply-adds (figures/experiments/cpu_peak.py). A fragment computes TURNS * ROUNDS
// multiply-adds for each of three vectors. The vectors fit in registers, and a processor overlaps their
// operations.

out vec4 sum;

const float FACTOR = 0.49;     // a constant: llvmpipe would fetch a uniform in every iteration

void main() {
    vec4 a = gl_FragCoord;
    vec4 b = a + 1.0;
    vec4 c = a + 2.0;
    for (int turn = 0; turn < TURNS; ++turn) {
        for (int k = 0; k < ROUNDS; ++k) {     // constant and short: compilers unroll this loop
            a = a * FACTOR + b;
            b = b * FACTOR + c;
            c = c * FACTOR + a;
        }
    }
    sum = a + b + c;
}
