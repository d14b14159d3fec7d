"""The method table: CLI, viewer, tests and figures take the list of methods from here."""
from __future__ import annotations

from ..errors import OptionError, nearest_names
from . import (
    bih, brute_force, bvh, geometry_image, grid, kdtree, ray_engine, ray_hierarchy, ray_space,
    ray_tiles
)
from .row import Accelerator, Method

_TABLE: dict[str, Method] = {}


def register(method: Method) -> Method:
    """Add a method to the table; its name must be new."""
    if method.name in _TABLE:
        raise OptionError(f"a method named {method.name!r} is in the table already")
    _TABLE[method.name] = method
    return method


def methods() -> list[Method]:
    """The table, as rows with .name, in the survey's order."""
    return list(_TABLE.values())


def find_method(name: str) -> Method:
    """The row of a name; OptionError suggests the nearest ones."""
    if name not in _TABLE:
        raise OptionError(f"no method {name!r}" + nearest_names(str(name), _TABLE))
    return _TABLE[name]


_FAMILIES = (brute_force, ray_engine, grid, kdtree, bvh, geometry_image, bih, ray_tiles,
             ray_hierarchy, ray_space)
for _family in _FAMILIES:
    for _row in _family.ROWS:
        register(_row)
