#version 330 core
// Tests whether each fragment writes to its own array at its own index. Mesa's softpipe uses one index for
// all four fragments of a 2 x 2 block (seen with Mesa 22.3). This would mix up the stacks of four rays.

const int LENGTH = 64;

uniform int turns;   // always 4, but unknown to the compiler

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
