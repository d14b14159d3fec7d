"""Results: a JSON file for each finished cell (cell.py). Files with old settings are ignored."""
from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gpgpu_rt.disk.files import read_json
from gpgpu_rt.gl.context import open_gpu

from .cell import Cell
from .works import work_of


def settings(cell: Cell) -> dict[str, Any]:
    """Return a cell's settings. A finished cell counts only if all its settings are unchanged."""
    return {**asdict(cell), "options": dict(cell.options), "renderer": open_gpu().renderer,
            "scene_sha256": work_of(cell).digest(cell),
            "version": importlib.metadata.version("gpgpu_rt")}


def as_kept(found: dict[str, Any]) -> dict[str, Any]:
    """Return ``found`` after a round trip through JSON."""
    return json.loads(json.dumps(found))


def read(cell: Cell, data: Path) -> dict[str, Any] | None:
    """Return the result of a finished cell; None if the file is missing, damaged, or has other
    settings."""
    try:
        result = read_json(data / cell.name)
        return result if result["settings"] == as_kept(settings(cell)) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def finished(cells: Iterable[Cell], data: Path) -> list[tuple[Cell, dict[str, Any]]]:
    """Return the finished cells with their results, in the given order. Each cell appears once."""
    found = ((cell, read(cell, data)) for cell in dict.fromkeys(cells))
    return [(cell, result) for cell, result in found if result is not None]
