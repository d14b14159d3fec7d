"""The texts of programs for a context of ANGLE: `es_text`, and three additions.

* A fragment program writes 1 to the render target by which ``FragmentCounter`` counts fragments.
* Points have the size 1, as in OpenGL. ES leaves their size undefined.
* A loop tests its condition before each pass of its body. SwiftShader compiles some loops wrongly
  that test it behind the body and contain other loops: under `loop`, kd-packet with two or more
  stack entries then lost hits of a few rays in a thousand. The same text is right on Mesa's
  renderers, and on SwiftShader in this form.
"""
from __future__ import annotations

import re

from .es import HEADER, es_text
from .fragment_counter import COUNTING_TARGET

_LONE_OUTPUT = re.compile(r"^out (\w+ \w+;)", re.M)
_DO = re.compile(r"\bdo \{")
_WHILE = re.compile(r"\s*while \(")
_BRACKET = re.compile(r"//[^\n]*|[(){}]")
_MAIN = "shader_main"
_VERTEX_END = f"""#undef main
void main() {{
    gl_PointSize = 1.0;
    {_MAIN}();
}}
"""
_FRAGMENT_END = f"""#undef main
layout(location = {COUNTING_TARGET}) out float counted_fragment;
void main() {{
    {_MAIN}();
    counted_fragment = 1.0;
}}
"""


def angle_texts(vertex: str, fragment: str) -> tuple[str, str]:
    """Return the texts of a (vertex, fragment) program. Lines keep their numbers.

    Raises
    ------
    ShaderError
        as `es_text`
    """
    return (_with_end(vertex, _VERTEX_END),
            _LONE_OUTPUT.sub(r"layout(location = 0) out \1", _with_end(fragment, _FRAGMENT_END)))


def _with_end(text: str, end: str) -> str:
    """Call the program's ``main`` from a new ``main``."""
    header = HEADER.rstrip("\n") + f"\n#define main {_MAIN}\n"
    return without_do(header + es_text(text).removeprefix(HEADER)) + end


def without_do(text: str) -> str:
    """Write each ``do {} while (...)`` as a ``for`` loop of the same meaning."""
    loops = list(_DO.finditer(text))
    for number, loop in reversed(list(enumerate(loops))):    # inner loops before outer loops
        body = _closed(text, loop.end())
        head = _WHILE.match(text, body)
        if head is None:
            raise ValueError(f"no while behind {text[loop.start():body]}")
        end = _closed(text, head.end())
        condition = " ".join(text[head.end():end - 1].split())
        again, lines = f"again_{number}", "\n" * text.count("\n", body, end)
        text = (f"{text[:loop.start()]}for (bool {again} = true; {again}; {again} = ({condition}))"
                f" {{{text[loop.end():body]}{lines}{text[end:].removeprefix(';')}")
    return text


def _closed(text: str, start: int) -> int:
    """Return the place behind the bracket that closes the bracket before ``start``."""
    depth = 1
    for bracket in _BRACKET.finditer(text, start):
        if bracket[0][0] != "/":
            depth += 1 if bracket[0] in "({" else -1
        if not depth:
            return bracket.end()
    raise ValueError(f"no bracket closes {text[start - 40:start]}")
