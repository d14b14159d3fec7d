"""About: the manual of a method, which is the comment at the head of its program."""
from __future__ import annotations

import re

from ..gl.shader import ROOT
from ..traversal.method import Method


def about(row: Method) -> list[str]:
    header = (ROOT / row.glsl).read_text(encoding="utf-8").split("\n\n")[0]
    lines = "\n".join(re.sub(r"^// ?", "", line) for line in header.splitlines())
    return [" ".join(part.split()) for part in lines.split("\n\n")]
