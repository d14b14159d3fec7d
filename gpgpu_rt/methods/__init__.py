"""The method table: CLI, viewer, tests and figures take the list of methods from here."""
from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import OptionError, nearest_names
from ..options import TRACER_OPTIONS
from ..traversal.method import Accelerator, Method
from . import plugins as found
from .bih import rows as bih
from .brute_force import rows as brute_force
from .bvh import rows as bvh
from .geometry_image import rows as geometry_image
from .grid import rows as grid
from .kdtree import rows as kdtree
from .ray_engine import rows as ray_engine
from .ray_hierarchy import rows as ray_hierarchy
from .ray_space import rows as ray_space
from .ray_tiles import rows as ray_tiles

_TABLE: dict[str, Method] = {}
_TAKEN: set[Path] = set()       # folders whose methods are in the table


def register(method: Method) -> Method:
    """Add a method to the table; its name must be new."""
    if method.name in _TABLE:
        raise OptionError(f"a method named {method.name!r} is in the table already")
    _TABLE[method.name] = method
    return method


def load_methods(folder: str | os.PathLike[str]) -> list[Method]:
    """Add the methods of a folder to the table: every Python file there with ``ROWS``.

    They are then there for everything that asks the table, and for processes started from this
    one. The environment variable GPGPU_RT_METHODS does the same for the folders it names.

    Parameters
    ----------
    folder : of files such as CONTRIBUTING.md shows; those that begin with "_" are left out

    Returns
    -------
    the rows that are new, none where the folder was loaded before

    Raises
    ------
    MethodError
        no such folder, a file that does not run, or a row that is not one: names file and line;
        nothing of the folder is in the table then
    """
    _take_named()
    path = Path(folder).resolve()
    new = _take(path)
    found.name_folder(path)
    return new


def methods() -> list[Method]:
    """The table, as rows with .name, in the survey's order; then those of GPGPU_RT_METHODS."""
    _take_named()
    return list(_TABLE.values())


def find_method(name: str) -> Method:
    """The row of a name; OptionError suggests the nearest ones."""
    _take_named()
    if not isinstance(name, str):
        raise OptionError(f"method is {name!r}; give a method's name: {', '.join(_TABLE)}")
    if name == "auto":
        raise OptionError("auto is no method but a choice that Tracer, `render` and `trace` make "
                          f"in one process; here name a method: {', '.join(_TABLE)}")
    if name not in _TABLE:
        raise OptionError(f"no method {name!r}" + nearest_names(name, _TABLE))
    return _TABLE[name]


def taking(options: Mapping[str, Any], some: Iterable[Method] | None = None) -> list[Method]:
    """Those of the table, or of ``some`` rows, that take all of these options.

    Raises
    ------
    OptionError
        where none does
    """
    rows = methods() if some is None else list(some)
    found = [row for row in rows if row.takes(options)]
    if not found and rows:
        known = {option.name for row in methods() for option in (*TRACER_OPTIONS, *row.options)}
        for name in set(options) - known:
            raise OptionError(f"no method has an option {name!r}" + nearest_names(name, known))
        raise OptionError("no method takes all of these options: "
                          + ", ".join(f"{k}={v}" for k, v in options.items()))
    return found


def _take_named() -> None:
    for folder in found.named_folders():
        _take(folder.resolve())


def _take(folder: Path) -> list[Method]:
    """The rows of a folder that were not taken yet, put into the table: all of them or none."""
    if folder in _TAKEN:
        return []
    before = set(_TABLE)
    _TAKEN.add(folder)      # at once: its files may ask for the table
    try:
        found.take(folder, register)
    except BaseException:
        _TAKEN.discard(folder)
        for name in set(_TABLE) - before:
            del _TABLE[name]
        raise
    return [row for name, row in _TABLE.items() if name not in before]


_FAMILIES = (brute_force, ray_engine, grid, kdtree, bvh, geometry_image, bih, ray_tiles,
             ray_hierarchy, ray_space)
for _family in _FAMILIES:
    for _row in _family.ROWS:
        register(_row)
