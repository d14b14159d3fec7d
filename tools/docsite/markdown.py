"""Makes Markdown: tables, and text in which no character acts as markup."""
from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#~$])")
_CODE = re.compile(r"(``.+?``|`[^`]+`)")


def plain(text: str) -> str:
    """Returns Markdown that shows a text as it stands, with code in backticks."""
    parts = _CODE.split(" ".join(text.split()))
    parts[0::2] = [_SPECIAL.sub(r"\\\1", part) for part in parts[0::2]]
    parts[1::2] = [code(part.strip("`")) for part in parts[1::2]]
    return "".join(parts)


def code(text: str) -> str:
    """Returns Markdown for code; a table can also contain this Markdown."""
    return f"`{text}`".replace("|", "\\|")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a Markdown table; "" without rows."""
    lines = [" | ".join(row) for row in rows]
    if not lines:
        return ""
    return "\n".join(f"| {line} |" for line in [" | ".join(head), "|".join(["---"] * len(head)),
                                                *lines]) + "\n"
