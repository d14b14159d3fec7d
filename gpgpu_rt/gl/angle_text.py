"""Programs for ANGLE: `es_text` translates a program's text, and this module makes five changes.

A fragment program writes 1 to the render target in which ``FragmentCounter`` counts fragments,
unless the program uses this target itself. An output without a location gets location 0, because
ES requires locations if a program has several outputs. Points get the size 1, because ES leaves
their size undefined. `without_do` rewrites loops, because SwiftShader compiles some loops wrongly.
`without_branches` rewrites selections (?:, &&, ||), because SwiftShader compiles branches slowly.
"""
from __future__ import annotations

import re

from .es import HEADER, es_text
from .fragment_counter import COUNTING_TARGET
from .loops import without_do
from .selections import FUNCTIONS, without_branches

_LAST_OUTPUT = f"layout(location = {COUNTING_TARGET}) out "
_LONE_OUTPUT = re.compile(r"^out (\w+ \w+;)", re.M)
_MAIN = "shader_main"
_VERTEX_END = f"""#undef main
void main() {{
    gl_PointSize = 1.0;
    {_MAIN}();
}}
"""
_UNCOUNTED_END = f"""#undef main
void main() {{
    {_MAIN}();
}}
"""
_FRAGMENT_END = f"""#undef main
{_LAST_OUTPUT}float counted_fragment;
void main() {{
    {_MAIN}();
    counted_fragment = 1.0;
}}
"""


def angle_texts(vertex: str, fragment: str) -> tuple[str, str]:
    """Return the texts of a (vertex, fragment) program, with unchanged line numbers.

    Raises
    ------
    ShaderError
        as `es_text` does
    """
    end = _FRAGMENT_END if _LAST_OUTPUT not in fragment else _UNCOUNTED_END
    return (_with_end(vertex, _VERTEX_END),
            _LONE_OUTPUT.sub(r"layout(location = 0) out \1", _with_end(fragment, end)))


def _with_end(text: str, end: str) -> str:
    # Put FUNCTIONS on the line before the first #define, to keep the line numbers.
    header = HEADER.rstrip("\n").replace("\n#define", f" {FUNCTIONS}\n#define", 1)
    body = without_branches(without_do(es_text(text).removeprefix(HEADER)))
    return f"{header}\n#define main {_MAIN}\n{body}{end}"
