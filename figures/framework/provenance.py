"""Provenance: records where a figure's numbers come from, in a JSON file beside its page.

``out/NAME.json`` is written with the page. It holds the figure's table, the verdict, and the file,
settings, renderer, commit and date of each measurement. A diagram has no measurements; its JSON
file names the renderer of the passes that the diagram shows.
"""
from __future__ import annotations

import csv
import datetime
import importlib.metadata
import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gpgpu_rt.disk.files import read_json, replacing
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.environment import commit
from gpgpu_rt.text_format import counted

from .cell import Cell
from .results import finished
from .verdicts import Verdict


def sources(cells: Iterable[Cell], data: Path) -> list[dict[str, Any]]:
    """The file, settings, renderer, commit, date and processor time of each finished cell
    (cell.py)."""
    return [{"file": cell.name, "settings": result["settings"],
             "renderer": result.get("gpu", {}).get("renderer"),
             "commit": result.get("commit"), "date": result.get("date"),
             "processor_seconds": result.get("processor_seconds")}
            for cell, result in finished(cells, data)]


def record(name: str, cells: Iterable[Cell], data: Path, out: Path, full: bool,
           judged: Verdict | None = None) -> None:
    """Write out/NAME.json for a page that was drawn.

    Parameters
    ----------
    judged : the verdict; None for a figure beyond the survey
    """
    table = out / f"{name}.csv"
    rows: list[dict[str, str]] = []
    if table.exists():
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    held = {"figure": name, "size": "full" if full else "quick",
            "drawn": {"renderer": open_gpu().renderer, "commit": commit(),
                      "date": datetime.date.today().isoformat(),
                      "version": importlib.metadata.version("gpgpu_rt")},
            "verdict": judged and asdict(judged),
            "cells": sources(cells, data), "rows": rows}
    with replacing(out / f"{name}.json") as path:
        path.write_text(json.dumps(held, indent=1))


def held(name: str, out: Path) -> dict[str, Any] | None:
    """The content of out/NAME.json; None if the page is missing or drawn by an older version."""
    try:
        found = read_json(out / f"{name}.json")
    except (OSError, ValueError):
        return None
    whole = isinstance(found, dict) and {"verdict", "cells"} <= set(found) and (
        found["verdict"] is None or Verdict.from_json(found["verdict"]) is not None)
    return found if whole and (out / f"{name}.md").exists() else None


def spent(pages: Iterable[dict[str, Any]]) -> tuple[float, int]:
    """Return the processor seconds of the pages' cells, and the number of cells without a time.

    A cell that several pages use counts once. Older versions did not record the time.
    """
    said = {cell["file"]: cell["processor_seconds"] for page in pages for cell in page["cells"]}
    return (sum(seconds for seconds in said.values() if seconds is not None),
            sum(seconds is None for seconds in said.values()))


def summary(held: dict[str, Any]) -> str:
    """Return one line: the number of a page's measurements, their renderers, commits and dates."""
    cells = held["cells"] or [held["drawn"]]
    words = [", ".join(sorted({str(cell[key]) for cell in cells}))
             for key in ("renderer", "commit", "date")]
    count = (counted(len(held["cells"]), "measurement") if held["cells"]
             else "drawn from observed passes")
    return f"{count}; {words[0]}; commit {words[1]}; {words[2]}"
