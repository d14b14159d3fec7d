// Defines units and error margins of the hierarchy over rays. All computations are float32, under every
// value of the option `arithmetic`. U is float32's unit roundoff. Lengths are multiplied by `unit`, a power
// of two, so no square overflows. TINY is added where a square may underflow.

const float U = 5.9604645e-8;
const float UNIT_ERROR = 16.0 * U;   // bounds the error of a normalised vector, in length and in direction
const float WIDENED = 1.0 + 16.0 * U;
const float TINY = 1e-18;

uniform float unit;   // the scene's size is about 1 / unit
