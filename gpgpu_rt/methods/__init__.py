"""The method table. Command line, viewer, tests and figures read their list of methods here."""
from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import OptionError, nearest_names
from ..options import TRACER_OPTIONS
from ..traversal.method import Accelerator, Method
from . import plugins
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
_FILES: dict[str, Path] = {}    # the Python file of each row
_LOADED: set[Path] = set()      # folders whose methods are in the table


def register(method: Method, file: Path | None = None) -> Method:
    """Add a method to the table; its name must be new. ``file`` is where the row stands."""
    if method.name in _TABLE:
        raise OptionError(f"a method named {method.name!r} exists already")
    _TABLE[method.name] = method
    if file is not None:
        _FILES[method.name] = file
    return method


def file_of(name: str) -> Path | None:
    """The Python file of a method's row; None for a row that a program registered."""
    return _FILES.get(find_method(name).name)


def load_methods(folder: str | os.PathLike[str]) -> list[Method]:
    """Add the methods of a folder to the table: the ``ROWS`` of every Python file in the folder.

    Everything that reads the table then knows the methods, and so do processes that this process
    starts. The environment variable GPGPU_RT_METHODS loads the folders that it names in the same
    way.

    Parameters
    ----------
    folder : holds Python files as CONTRIBUTING.md describes; files whose names begin with "_" are
        skipped

    Returns
    -------
    the rows that were added; an empty list if the folder was loaded before

    Raises
    ------
    MethodError
        if the folder does not exist, a file fails to run, or a row is invalid. The message names
        file and line. The table then holds no method of the folder.
    """
    _load_named()
    path = Path(folder).resolve()
    new = _load(path)
    plugins.name_folder(path)
    return new


def methods() -> list[Method]:
    """All rows of the table: the survey's methods in its order, then those of other folders."""
    _load_named()
    return list(_TABLE.values())


def find_method(name: str) -> Method:
    """The row of the method ``name``; if there is none, OptionError suggests similar names."""
    _load_named()
    if not isinstance(name, str):
        raise OptionError(f"method is {name!r}; give a method's name: {', '.join(_TABLE)}")
    if name == "auto":
        raise OptionError("auto is not a method: only Tracer, `render` and `trace`, in a single "
                          f"process, choose a method by it; name a method: {', '.join(_TABLE)}")
    if name not in _TABLE:
        raise OptionError(f"no method {name!r}" + nearest_names(name, _TABLE))
    return _TABLE[name]


def taking(options: Mapping[str, Any], some: Iterable[Method] | None = None) -> list[Method]:
    """The rows (of ``some``, or of the whole table) whose methods accept all given options.

    Raises
    ------
    OptionError
        if no method accepts all of them
    """
    rows = methods() if some is None else list(some)
    found = [row for row in rows if row.takes(options)]
    if not found and rows:
        known = {option.name for row in methods() for option in (*TRACER_OPTIONS, *row.options)}
        for name in set(options) - known:
            raise OptionError(f"no method has an option {name!r}" + nearest_names(name, known))
        raise OptionError("no method accepts all of these options: "
                          + ", ".join(f"{k}={v}" for k, v in options.items()))
    return found


def _load_named() -> None:
    for folder in plugins.named_folders():
        _load(folder.resolve())


def _load(folder: Path) -> list[Method]:
    """Add a folder's rows to the table, all or none, and return the rows that are new."""
    if folder in _LOADED:
        return []
    before = set(_TABLE)
    _LOADED.add(folder)      # before its files run, because they may read the table
    try:
        plugins.register_folder(folder, register)
    except BaseException:
        _LOADED.discard(folder)
        for name in set(_TABLE) - before:
            del _TABLE[name]
            _FILES.pop(name, None)
        raise
    return [row for name, row in _TABLE.items() if name not in before]


_FAMILIES = (brute_force, ray_engine, grid, kdtree, bvh, geometry_image, bih, ray_tiles,
             ray_hierarchy, ray_space)
for _family in _FAMILIES:
    for _row in _family.ROWS:
        register(_row, Path(_family.__file__))
