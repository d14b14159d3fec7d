// Units and margins of the hierarchy over rays. All of it is float32 whatever the option `arithmetic`; U is
// float32's unit roundoff. Lengths are in units of about the scene's size, exact powers of two, so that
// no square of one overflows, and TINY covers those that underflow.

const float U = 5.9604645e-8;
const float UNIT_ERROR = 16.0 * U;   // of what normalising leaves: length and direction
const float WIDENED = 1.0 + 16.0 * U;
const float TINY = 1e-18;

uniform float unit;   // the scene's size is about 1 / unit
