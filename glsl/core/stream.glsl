// The stream element of a fragment. Streams wrap in rows as tables do.

#include "core/fetch.glsl"

uniform int last_element;   // index of the last element drawn

// Fragments that only complete a block of four also run, and their results are discarded. They process the
// last element. Past the last element a loop might never end, and a renderer with a limit on iterations
// would then stop the loops of the neighbouring fragments too.
int element() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    return min(texel.x + (texel.y << TABLE_WIDTH_LOG2), last_element);
}
