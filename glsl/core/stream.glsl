// The stream element of a fragment. Streams wrap in rows as tables do.

#include "core/fetch.glsl"

uniform int last_element;   // index of the last element drawn

// OpenGL runs fragments in blocks of 2 x 2. Fragments of a block that lie beyond the stream's end process
// the last element again; their results are discarded. With undefined data their loops might never end, and
// an OpenGL renderer that limits iterations would also stop the loops of the block's other fragments.
int element() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    return min(texel.x + (texel.y << TABLE_WIDTH_LOG2), last_element);
}
