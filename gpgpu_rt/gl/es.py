"""ES: rewrites a program's text from GLSL 3.30 to GLSL ES 3.00, the language of WebGL 2.

The rewriting is mechanical. ES has no `precise`. A global variable must be initialised by a
constant, so another initialiser becomes a macro. ES's preprocessor joins no names, so the one
macro that joins names is expanded here.
"""
from __future__ import annotations

import re

from ..errors import ShaderError

_HEADER = """#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
#define PRECISE
"""
# The compiled text begins with the extension and `precise`. The printed text names the extension
# alone, in a later line.
_VERSION = re.compile(r"\A#version 330 core\n(?:#extension .*?#endif\n)?", re.S)
_EXTENSION = re.compile(r"^#extension .*\n", re.M)
_GLOBAL = re.compile(r"^(?:const )?(?:float|int|uint|i?vec[234]) (\w+) = ([^;]+);([ \t]*//.*)?$",
                     re.M)
_NOT_CONSTANT = re.compile(r"\b(textureSize|uintBitsToFloat)\(")
_PASTE = re.compile(r"\bTABLE_FETCH\((\w+), ([^()]*)\)")
_PASTES = re.compile(r"^#define TABLE_FETCH\(.*$", re.M)


def es_text(text: str) -> str:
    """Return the text of a vertex or fragment program in GLSL ES 3.00.

    Parameters
    ----------
    text : a resolved text, as `ObservedPass.texts` or `program_text` has it

    Raises
    ------
    ShaderError
        the text joins names in a macro that this function does not know
    """
    body, found = _VERSION.subn(_HEADER, text)
    if not found:
        raise ShaderError("a program does not begin with #version 330 core")
    body = _EXTENSION.sub("", body)
    body = _PASTE.sub(r"TEXEL(\1_table, vec2(TABLE_COLUMN, \1_table_row), table_texel(\2))",
                      _PASTES.sub("", body))
    line = next((line for line in body.splitlines() if "##" in line.partition("//")[0]), None)
    if line is not None:
        raise ShaderError(f"GLSL ES joins no names, but a macro does: {line.strip()}")
    return _GLOBAL.sub(_as_macro, body)


def _as_macro(found: re.Match[str]) -> str:
    name, value, comment = found.groups()
    if not _NOT_CONSTANT.search(value):
        return found.group()
    return f"#define {name} ({value}){comment or ''}"
