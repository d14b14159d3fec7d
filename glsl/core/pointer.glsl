// A pointer to an element of a table: the element's index, or a number below 0 for no element.
//
// A float of 24 bits cannot hold every index of a large table. So in the era form with fp24 (docs/era.md,
// TEXEL_POINTERS), a pointer is the column and the row of the element's texel, as in the papers.

#ifdef TEXEL_POINTERS

#define pointer vec2

const vec2 FIRST = vec2(0.0, 0.0);
const vec2 NOWHERE = vec2(-1.0, 0.0);

// Return the pointer to the element `n` places after p. fp24 is exact if column + n is at most 131,072.
vec2 moved(vec2 p, float n) {
    float column = p.x + n;
    float rows = floor(column * (1.0 / TABLE_WIDTH));
    return vec2(column - TABLE_WIDTH * rows, p.y + rows);
}

vec2 pointer_to(float index) {
    return moved(FIRST, index);
}

// Return the pointer to element n * i, if p points to element i.
vec2 multiplied(vec2 p, float n) {
    return moved(p * n, 0.0);
}

// The first number of a pointer; below 0 for no element.
float code_of(vec2 p) {
    return p.x;
}

#else

#define pointer int

const int FIRST = 0;
const int NOWHERE = -1;

int moved(int p, int n) {
    return p + n;
}

int pointer_to(int index) {
    return index;
}

int multiplied(int p, int n) {
    return p * n;
}

int code_of(int p) {
    return p;
}

#endif

bool is_null(pointer p) {
    return code_of(p) < 0;
}
