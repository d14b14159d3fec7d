"""Loops: rewrites ``do`` loops, which test their condition after their body, as ``for`` loops.

SwiftShader wrongly compiles some ``do`` loops that contain other loops: rays lost hits.
SwiftShader compiles the ``for`` loops correctly.
"""
from __future__ import annotations

import re

_DO = re.compile(r"\bdo \{")
_WHILE = re.compile(r"\s*while \(")
_BRACKET = re.compile(r"//[^\n]*|[(){}]")


def without_do(text: str) -> str:
    """Write each ``do {} while (...)`` as an equivalent ``for`` loop."""
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
    """Return the position after the bracket that closes the bracket just before ``start``."""
    depth = 1
    for bracket in _BRACKET.finditer(text, start):
        if bracket[0][0] != "/":
            depth += 1 if bracket[0] in "({" else -1
        if not depth:
            return bracket.end()
    raise ValueError(f"no bracket closes {text[start - 40:start]}")
