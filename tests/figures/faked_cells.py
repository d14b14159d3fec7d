"""Writes faked cells. A cell is one measurement of a figure. The file of a faked cell looks like
the file of a measured cell, but a test chooses its numbers."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gpgpu_rt.figures.framework import results
from gpgpu_rt.figures.framework.cell import Cell


def write_cell(cell: Cell, folder: Path, **more: Any) -> None:
    """Writes a cell's file as if the cell had been measured. ``more`` adds or replaces entries."""
    (folder / cell.name).write_text(json.dumps({
        "settings": results.settings(cell), "gpu": {"renderer": "llvmpipe X", "backend": "egl"},
        "commit": "abc1234", "date": "2020-01-01", "rays": cell.size ** 2,
        "scene": {"triangles": 10_000, "stand_in": None}, "statistics": {}, "counters": {},
        "processor_seconds": 2.0, **more}))
