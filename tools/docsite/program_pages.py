"""Lists the files of the GLSL programs, each with the comment at its beginning."""
from __future__ import annotations

import re

from .links import ROOT
from .markdown import code, plain, table

_GLSL = ROOT / "glsl"
_HEAD = re.compile(r"(?:#version [^\n]*\n)?((?://[^\n]*\n)+)")


def programs_text() -> str:
    folders: dict[str, list[tuple[str, str]]] = {}
    for path in sorted(_GLSL.rglob("*")):
        head = _HEAD.match(path.read_text(encoding="utf-8")) if path.suffix in (
            ".glsl", ".frag", ".vert") else None
        if head:
            comment = re.sub(r"(?m)^// ?", "", head[1])
            folders.setdefault(str(path.parent.relative_to(ROOT)), []).append(
                (code(path.name), plain(comment)))
    return "".join(f"\n## {name}\n\n{table(('file', 'what it does'), rows)}"
                   for name, rows in folders.items())
