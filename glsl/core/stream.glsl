// The element of a stream that a fragment stands for: streams wrap in rows as tables do.

#include "core/fetch.glsl"

uniform int last_element;   // of those drawn

// Fragments that only complete a block of four run as well, and what they do is thrown away. They
// stand for the last element: past it a loop might find no end, and a renderer with a limit on
// iterations would stop that of their neighbours too.
int element() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    return min(texel.x + (texel.y << TABLE_WIDTH_LOG2), last_element);
}
