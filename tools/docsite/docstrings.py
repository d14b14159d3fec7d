"""Converts the project's docstrings to reStructuredText, which Sphinx reads.

In numpy's sections Parameters and Attributes, ``name : meaning`` begins an entry.
"""
from __future__ import annotations

import re
from collections.abc import Sequence

_TITLES = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Notes", "Examples")
_ENTRY = re.compile(r"(\S[^:]*?) : (.*)")
_CODE = re.compile(r"(``.+?``|`[^`\n]+`)")


def to_rst(lines: Sequence[str]) -> list[str]:
    found: list[str] = []
    title = ""
    rest = iter(range(len(lines)))
    for at in rest:
        line = lines[at]
        below = lines[at + 1] if at + 1 < len(lines) else ""
        if line in _TITLES and re.fullmatch("-+", below):
            title = line
            next(rest)
            found += ["", f".. rubric:: {title}", ""]
        elif title in ("Parameters", "Attributes") and _ENTRY.fullmatch(line):
            names, meaning = _ENTRY.fullmatch(line).groups()
            found += [f"``{names}``", f"    {_escaped(meaning)}"]
        else:
            if _begins_list(line, found[-1] if found else ""):
                found.append("")
            found.append(_escaped(line))
            if title == "Raises" and line[:1].strip() and below[:1].strip():
                found.append("")    # an error without an explanation
    return [*found, ""]


def _begins_list(line: str, before: str) -> bool:
    """Returns whether ``line`` begins a list directly below a paragraph."""
    bullets = ("* ", "- ")
    return (line.lstrip().startswith(bullets) and bool(before.strip())
            and not before.lstrip().startswith(bullets)
            and _indent(before) <= _indent(line))


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _escaped(line: str) -> str:
    """Returns a line in which all markup except code is escaped; `code` becomes ``code``."""
    bullet = re.match(r" *[*-] ", line)
    if bullet:
        return bullet[0] + _escaped(line[bullet.end():])
    parts = _CODE.split(line)
    parts[0::2] = [re.sub(r"([|*\\])|(?<=\w)(_)(?!\w)", r"\\\1\2", text) for text in parts[0::2]]
    parts[1::2] = [f"``{code.strip('`')}``" for code in parts[1::2]]
    return "".join(parts)
