"""Where a figure's numbers come from: a JSON file beside its page, with renderer and commit.

``out/NAME.json`` holds the table under the figure, and the cells it was made of: file, settings,
renderer, commit and date of each. Diagrams have no cells; what they show was read from passes that
ran when they were drawn, and the file says on what.
"""
from __future__ import annotations

import csv
import datetime
import importlib.metadata
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gpgpu_rt.files import replacing
from gpgpu_rt.gpu import open_gpu

from .cell import Cell
from .results import commit, finished


def sources(cells: Iterable[Cell], data: Path) -> list[dict[str, Any]]:
    """Of each finished cell: its file, and what it was measured with."""
    return [{"file": cell.name, "settings": result["settings"],
             "renderer": result.get("gpu", {}).get("renderer"),
             "commit": result.get("commit"), "date": result.get("date"),
             "processor_seconds": result.get("processor_seconds")}
            for cell, result in finished(cells, data)]


def record(name: str, cells: Iterable[Cell], data: Path, out: Path, full: bool) -> dict[str, Any]:
    """Write out/NAME.json; returns what it holds."""
    table = out / f"{name}.csv"
    rows: list[dict[str, str]] = []
    if table.exists():
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    held = {"figure": name, "size": "full" if full else "quick",
            "drawn": {"renderer": open_gpu().renderer, "commit": commit(),
                      "date": datetime.date.today().isoformat(),
                      "version": importlib.metadata.version("gpgpu_rt")},
            "cells": sources(cells, data), "rows": rows}
    with replacing(out / f"{name}.json") as path:
        path.write_text(json.dumps(held, indent=1))
    return held


def summary(held: dict[str, Any]) -> str:
    """One line: how many cells, of which commits, renderers and days."""
    cells = held["cells"] or [held["drawn"]]
    words = [", ".join(sorted({str(cell[key]) for cell in cells}))
             for key in ("renderer", "commit", "date")]
    count = f"{len(held['cells'])} cells" if held["cells"] else "drawn from passes as they ran"
    return f"{count}; {words[0]}; commit {words[1]}; {words[2]}"
