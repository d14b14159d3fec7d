"""Record meaning: finds the text below a record's declaration in Python."""
from __future__ import annotations

import ast
import re
import sys
from functools import lru_cache
from pathlib import Path

from ..gl.record import Record


def meaning(record: Record) -> dict[str, str]:
    """Return what a record and its fields mean.

    Returns
    -------
    dict
        name in Python -> the text below the declaration. The dict has the record, and each record
        that a text of the dict names. The dict is empty if no module declares the record
    """
    found: dict[str, str] = {}
    texts = _texts()
    names = [name for name, (declared, _) in texts.items() if declared == record][:1]
    while names:
        name = names.pop(0)
        if name in texts and name not in found:
            found[name] = texts[name][1]
            names += re.findall(r"\b[A-Z]+(?:_[A-Z0-9]+)*\b", found[name])
    return found


@lru_cache(maxsize=None)
def _texts() -> dict[str, tuple[Record, str]]:
    package = __name__.partition(".")[0] + "."
    return {name: (getattr(module, name), text)
            for module_name, module in sorted(sys.modules.items())
            if module_name.startswith(package) and module_name.endswith(".records")
            for name, text in texts_below(Path(str(module.__file__))).items()
            if isinstance(getattr(module, name), Record)}


def texts_below(file: Path) -> dict[str, str]:
    """Return name -> the text below the name's assignment in a Python module. Assignments without
    a text between them share the next text."""
    found: dict[str, str] = {}
    waiting: list[str] = []
    for statement in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            waiting.append(statement.targets[0].id)
        elif (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
                and isinstance(statement.value.value, str)):
            found.update(dict.fromkeys(waiting, _joined(statement.value.value)))
            waiting = []
    return found


def _joined(text: str) -> str:
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n")).strip()
