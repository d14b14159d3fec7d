"""Selections on ANGLE: the operators ?:, && and || become calls of functions where this is safe,
and stay operators elsewhere."""
from __future__ import annotations

import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.selections import FUNCTIONS, without_branches

PROGRAM = """#define TWICE(x) (2.0 * (x))
#define NEXT(x) (x = x + 1.0)
uniform float most;
float kept;
struct Pair {{ float a; float b; }};
float halved(float x) {{
    return 0.5 * TWICE(x);
}}
float fetched(int x) {{
    return texelFetch(t, ivec2(x, 0), 0).x * s[x];
}}
float stepped(float x) {{
    kept = x;
    return x;
}}
float split(float x, out float whole) {{
    whole = floor(x);
    return x - whole;
}}
float least(float x) {{
    do {{
        x -= 1.0;
    }}
    while (x > 1.0);
    return x;
}}
float element(int x) {{
    return s[x + 1];
}}
float dropped(float x) {{
    discard;
    return x;
}}
float summed(float x) {{
    float sum = 0.0;
    for (int i = 0; i < 9; ++i) {{
        sum += x;
    }}
    return sum;
}}
float z = most > 0.0 ? most + 1.0 : 2.0;
void main() {{
    {}
}}
"""


@pytest.mark.parametrize("line, written", [
    ("y = a > b ? a + 1.0 : b;", "y = picked_value(a > b, a + 1.0, b);"),
    ("return c ? -1 : d ? x.y * 2 : 3;",
     "return picked_value(c, -1, picked_value(d, x.y * 2, 3));"),
    ("y = f(c ? 1.0 : g + g, !d);", "y = f(picked_value(c, 1.0, g + g), !d);"),
    ("bool y = a > 0.0 && b > 0.0 || c;",
     "bool y = either_holds(both_hold(a > 0.0, b > 0.0), c);"),
    ("for (; on && i < 3; ++i) { y += d || e ? max(a, b) : b; }",
     "for (; both_hold(on, i < 3); ++i) { y += picked_value(either_holds(d, e), max(a, b), b); }"),
    # functions and macros without side effects
    ("y = c ? halved(a) : TWICE(b);", "y = picked_value(c, halved(a), TWICE(b));"),
    ("y = c ? texture(t, a).x : fetched(i);", "y = picked_value(c, texture(t, a).x, fetched(i));"),
    # Only the name of a function's parameter, such as `x`, counts as an index inside the array
    # (selections.py).
    ("y = c ? s[x] : b;", "y = picked_value(c, s[x], b);"),
    # GLSL always evaluates the first operand, so this operand may be an element of an array.
    ("y = s[i] > 0 && c;", "y = both_hold(s[i] > 0, c);"),
    ("y = s[i] > 0 ? a : -b;", "y = picked_value(s[i] > 0, a, -b);"),
    # a comment and a line break inside a selection
    ("y = c    // why ? or not\n        ? a + b\n        : b;",
     "y = picked_value(c    // why ? or not\n, a + b\n, b);")])
def test_selections_become_calls(line: str, written: str) -> None:
    assert without_branches(PROGRAM.format(line)) == PROGRAM.format(written)


@pytest.mark.parametrize("line", [
    "y = c ? a : b;",                              # ANGLE makes no branch if both values are names
    "y = c ? s[i] : b + b;",                       # the index may be outside the array
    "y = c ? stepped(a) : b;", "y = c && stepped(a) > 0.0;", "y = stepped(a) > 0.0 && c;",
    "y = c ? NEXT(a) : b;", "y = c ? a++ : b;", "y = (a = b) > 0.0 && c;",
    "y = c ? summed(a) : b;", "y = c ? least(a) : b;",         # loops
    "y = stepped(a) > 0.0 ? a + b : b;", "y = c ? split(a, b) : b;",
    "y = c ? dropped(a) : b;", "y = c ? s[x + 1] : b;", "y = c ? element(i) : b;",
    "y = c ? unknown(a) : b;", "y = c ? Pair(a, b) : p;",
    "const int y = 1 > 0 ? 1 + 1 : 2;",            # a constant may not call functions
    "y = c\n#ifdef D\n        ? a + b : b;\n#else\n        ? a - b : b;\n#endif"])
def test_the_text_stays(line: str) -> None:
    assert without_branches(PROGRAM.format(line)) == PROGRAM.format(line)


def test_a_bracket_that_two_branches_open() -> None:
    """Both branches of an #ifdef may open a bracket that is closed once, after the #endif."""
    line = ("#ifdef D\n    if (a) {\n#else\n    if (b > 0 && c) {\n#endif\n"
            "        y = c ? 1 + 1 : 2;\n    }")
    written = line.replace("b > 0 && c", "both_hold(b > 0, c)").replace(
        "c ? 1 + 1 : 2", "picked_value(c, 1 + 1, 2)")
    assert without_branches(PROGRAM.format(line)) == PROGRAM.format(written)


def test_the_functions_are_a_single_line() -> None:
    assert "\n" not in FUNCTIONS and without_branches(FUNCTIONS) != ""


@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_programs_keep_their_lines(method: str) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, method) as tracer, tracer.observe() as passes:
        tracer.trace(*scene.camera.rays((4, 4)))
    for text in {text for one in passes for text in one.texts}:
        written = without_branches(text)
        assert written.count("\n") == text.count("\n")
        for bracket in "{}[];":
            assert written.count(bracket) == text.count(bracket)
