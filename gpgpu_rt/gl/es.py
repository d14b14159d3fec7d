"""ES: rewrites a program's text from GLSL 3.30 to GLSL ES 3.00, the language of WebGL 2.

ES has no `precise`, so the macro PRECISE is empty. A global variable of ES needs a constant
initialiser, so a variable with another initialiser becomes a macro. ES cannot join names by
``##``, so macros that join names are expanded here.
"""
from __future__ import annotations

import re

from ..errors import ShaderError

# This header has as many lines as the text that it replaces, so errors name the right lines.
HEADER = """#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
#define PRECISE

"""
# HEADER replaces the line #version. In `ObservedPass.texts`, the lines that enable an extension
# and define PRECISE come next, and HEADER replaces them too. In a text from `program_text`, the
# line #extension comes later: _EXTENSION finds this line, and `es_text` removes it.
_VERSION = re.compile(r"\A#version 330 core\n(?:#extension .*?#endif\n)?", re.S)
_EXTENSION = re.compile(r"^#extension .*\n", re.M)
_GLOBAL = re.compile(r"^(?:const )?(?:float|int|uint|i?vec[234]) (\w+) = ([^;]+);([ \t]*//.*)?$",
                     re.M)
_UNIFORM = re.compile(r"^uniform \w+ (\w+)", re.M)
_MACRO = re.compile(r"^#define (\w+)\(([^()]*)\) (.*)$", re.M)


def es_text(text: str) -> str:
    """Return the text of a vertex or fragment program in GLSL ES 3.00.

    Parameters
    ----------
    text : a text without includes, as in `ObservedPass.texts` or from `program_text`

    Raises
    ------
    ShaderError
        if the text does not begin with #version 330 core, or joins names in a macro that cannot
        be expanded
    """
    body, found = _VERSION.subn(HEADER, text)
    if not found:
        raise ShaderError("a program does not begin with #version 330 core")
    body = _without_joined_names(_EXTENSION.sub("", body))
    changing = ("textureSize", "uintBitsToFloat", *_UNIFORM.findall(body))
    not_constant = re.compile(rf"\b({'|'.join(changing)})\b")

    def as_macro(found: re.Match[str]) -> str:
        name, value, comment = found.groups()
        if not not_constant.search(value):
            return found.group()
        return f"#define {name} ({value}){comment or ''}"

    return _GLOBAL.sub(as_macro, body)


def _without_joined_names(text: str) -> str:
    macros = {name: ([one.strip() for one in names.split(",")], body)
              for name, names, body in _MACRO.findall(text)}
    # A macro such as EACH_TARGET calls its argument, which is the name of another macro.
    callers = {name: (names, body) for name, (names, body) in macros.items()
               if any(re.search(rf"\b{one}\(", body) for one in names)}
    joining = {name: macro for name, macro in macros.items() if "##" in macro[1]}
    for name, (names, body) in joining.items():
        text = re.sub(rf"^#define {name}\(.*$", "", text, flags=re.M)
        for caller, (parameters, calls) in callers.items():
            if len(parameters) == 1:
                called = re.sub(rf"\b{parameters[0]}\(", f"{name}(", calls)
                text = re.sub(rf"\b{caller}\({name}\)", lambda _: called, text)
        text = _expanded(text, name, names, body)
    line = next((line for line in text.splitlines() if "##" in line.partition("//")[0]), None)
    if line is not None:
        raise ShaderError(f"GLSL ES cannot join names, but a macro does: {line.strip()}")
    return text


def _expanded(text: str, name: str, names: list[str], body: str) -> str:
    call = re.compile(rf"\b{name}\(")
    while (found := call.search(text)) is not None:
        values, end = _arguments(text, found.end())
        if len(values) != len(names):
            raise ShaderError(f"GLSL ES cannot join names, so calls of the macro {name} are "
                              f"expanded; a call must have {len(names)} values, but this call "
                              f"does not: {text[found.start():end]}")
        line = text[text.rfind("\n", 0, found.start()) + 1:end]
        if line.startswith("#define"):
            raise ShaderError(f"GLSL ES cannot join names, but the macro {name} does, and "
                              f"another macro calls it: {line}")
        by_name = dict(zip(names, values))
        put = re.sub(r"\w+", lambda word: by_name.get(word[0], word[0]), body.replace("##", "\0"))
        text = text[:found.start()] + put.replace("\0", "") + text[end:]
    return text


def _arguments(text: str, start: int) -> tuple[list[str], int]:
    """Return the values and the end of a call whose opening bracket is before ``start``."""
    values, depth, at = [""], 0, start
    while at < len(text):
        letter = text[at]
        at += 1
        if letter == ")" and not depth:
            break
        depth += (letter == "(") - (letter == ")")
        if letter == "," and not depth:
            values.append("")
        else:
            values[-1] += letter
    return [value.strip() for value in values], at
