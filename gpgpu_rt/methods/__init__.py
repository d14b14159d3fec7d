"""The method table: a row for each method."""
from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import OptionError, did_you_mean, nearest_name, nearest_names
from ..options import TRACER_OPTIONS, Option
from ..traversal.accelerator import Accelerator
from ..traversal.method import Method
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
from .tree_unit import rows as tree_unit

_TABLE: dict[str, Method] = {}
_FILES: dict[str, Path] = {}    # the Python file of each row
_FAMILY: dict[str, str] = {}    # the family of each built-in method
_LOADED: set[Path] = set()      # folders that are in the table


def register(method: Method, file: Path | None = None) -> Method:
    """Add a method to the table and return the method. Its name must be new.

    ``file`` is the Python file that defines the row, if there is one.
    """
    if method.name in _TABLE:
        raise OptionError(f"a method named {method.name!r} exists already")
    _TABLE[method.name] = method
    if file is not None:
        _FILES[method.name] = file
    return method


def option_table(method: str) -> dict[str, Option]:
    """Return the options of a method and of the tracer, by name."""
    return {option.name: option for option in TRACER_OPTIONS + find_method(method).options}


def file_of(name: str) -> Path | None:
    """Return the Python file that defines a method's row; None if a program added the row."""
    return _FILES.get(find_method(name).name)


def family_of(name: str) -> str:
    """Return a method's family, such as "kd-tree"; "own method" for a user's method."""
    return _FAMILY.get(find_method(name).name, "own method")


def load_methods(folder: str | os.PathLike[str]) -> list[Method]:
    """Add the methods of a folder to the table: the ``ROWS`` of every Python file in the folder.

    Child processes load the folder, too: it is added to the environment variable GPGPU_RT_METHODS.
    The folders in this variable are loaded when the table is first read.

    Parameters
    ----------
    folder : folder of Python files as docs/how-to/add-a-method.md describes them; files whose
        names begin with "_" or "test_" are skipped

    Returns
    -------
    the rows that were added; an empty list if the folder was loaded before

    Raises
    ------
    MethodError
        if the folder does not exist, a file fails to run, or a row is invalid; then no method of
        the folder is added. The message names the folder or the file
    """
    _load_named()
    path = Path(folder).resolve()
    new = _load(path)
    plugins.name_folder(path)
    return new


def methods() -> list[Method]:
    """Return all rows: the methods in the order of Hachisuka's survey, then the users' methods."""
    _load_named()
    return list(_TABLE.values())


def built_in_methods() -> list[Method]:
    """Return the rows of the project's own methods, in the order of Hachisuka's survey."""
    return [row for row in methods() if row.name in _FAMILY]


def find_method(name: str) -> Method:
    """Return the row of a method. An unknown name raises OptionError with similar names."""
    _load_named()
    if not isinstance(name, str):
        raise OptionError(f"method is {name!r}; give a method's name: {', '.join(_TABLE)}")
    if name == "auto":
        raise OptionError("auto is not a method. Only Tracer, RayMeshIntersector, and the "
                          "commands `render` and `trace` without --scheduler accept auto and "
                          f"choose a method. Here, give one of: {', '.join(_TABLE)}")
    if name not in _TABLE:
        own = "" if _LOADED or "," in name or did_you_mean(name, _TABLE) else (
            "; --methods-from or load_methods loads your own methods")
        raise OptionError(f"no method {name!r}{own}" + nearest_name(name, _TABLE))
    return _TABLE[name]


def taking(options: Mapping[str, Any], some: Iterable[Method] | None = None) -> list[Method]:
    """Return the rows whose methods accept all given options.

    Parameters
    ----------
    options : option -> value
    some : the rows to choose from; None for the whole table

    Raises
    ------
    OptionError
        if no method accepts all these options
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
    """Add all rows of a folder to the table, or none after an error. Return the added rows."""
    if folder in _LOADED:
        return []
    before = set(_TABLE)
    # Mark first: a method file may read the table, which would load the folder again.
    _LOADED.add(folder)
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
             ray_hierarchy, ray_space, tree_unit)
for _family in _FAMILIES:
    for _row in _family.ROWS:
        register(_row, Path(_family.__file__))
        _FAMILY[_row.name] = _family.FAMILY
