#version 330 core
// Whether each fragment's writes to an array of its own go where its own index says. Mesa's softpipe
// takes one index for the four fragments of a square (seen with 22.3), and would mix up stacks.

const int LENGTH = 64;

uniform int turns;   // 4, which the compiler does not know

out vec4 kept;

void main() {
    int own = int(gl_FragCoord.x) + 8 * int(gl_FragCoord.y);
    float values[LENGTH];
    for (int k = 0; k < LENGTH; ++k) {
        values[k] = 0.0;
    }
    for (int k = 0; k < turns; ++k) {
        values[(own + 16 * k) % LENGTH] = float(own + k + 1);
    }
    kept = vec4(values[own], values[(own + 16) % LENGTH], values[(own + 32) % LENGTH],
                values[(own + 48) % LENGTH]);
}
