"""Structure: tells a page where to find a state's box or cell, and the triangle under test.

The page reads a ray's path from the states that the passes wrote, and runs no traversal. The
description names fields of the state, and the places of table fields in textures.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..gl.record import Record
from ..methods.grid.records import GRID_CELL
from ..methods.kdtree.records import KD_LEAF, KD_NODE
from ..traversal.method import Method
from ..traversal.records import TREE_STATE
from ..traversal.triangle_table import REFERENCE, TRIANGLE


def structure_of(method: Method, kernels: Sequence[str]) -> dict[str, Any]:
    """Return the description of a method's structure, ready for JSON.

    Parameters
    ----------
    kernels : the kernels for which a ray or packet can wait, in the order of phases

    Returns
    -------
    ``kernels`` names the kernels in the order of their phases. ``boxes`` is "cells" for a grid,
    "planes" for a kd-tree, "boxes" for nodes with boxes, and "" otherwise. ``places`` maps a field
    to (sampler, texels per record, the field's texel, swizzle). ``lags`` says whether the state
    already names the next node while a ray tests triangles. ``restarts`` says whether a ray can
    restart.
    """
    tables = {record.name: record for record in method.tables if isinstance(record, Record)}
    fields = {field.name for field in method.state.fields}
    places: dict[str, tuple[str, int, int, str]] = {}
    boxes = ""
    if GRID_CELL.name in tables and "cell" in fields:
        boxes = "cells"
    elif KD_NODE.name in tables and "node" in fields:
        boxes = "planes"
        places.update(_places(KD_NODE, "split", "axis", "left"))
    elif "node" in fields:
        for record in tables.values():
            # The page looks up boxes by node, but records of KD_LEAF are numbered by leaf.
            if record.name != KD_LEAF.name:
                names = {field.name for field in record.fields} & {"lo", "hi"}
                places.update(_places(record, *sorted(names)))
        boxes = "boxes" if {"lo", "hi"} <= set(places) else ""
    if TRIANGLE.name in tables and "cursor" in fields:
        places.update(_places(TRIANGLE, "v0", "v1", "v2"))
        if REFERENCE.name in tables:
            places.update(_places(REFERENCE, "triangle"))
    return {"kernels": list(kernels), "boxes": boxes, "places": places,
            "lags": method.state.layout == TREE_STATE.layout,
            "restarts": method.restarts}


def _places(record: Record, *names: str) -> dict[str, tuple[str, int, int, str]]:
    found = [(record.field(name), record.plane_of(record.field(name).texel)) for name in names]
    return {field.name: (f"{record.name}{plane.suffix}_table", plane.texels,
                         field.texel - plane.first, field.swizzle) for field, plane in found}
