"""geometry-image: quadtrees over images of positions (Carr, Hoberock, Crane and Hart 2006)."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...accel.bounds import shrink_flat
from ...errors import OptionError
from ...gl.precision import Precision
from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import Method
from ...traversal.records import TREE_STATE
from .boxes import image_boxes, octant_links
from .pyramid import Pyramid
from .records import IMAGE_CELL, MAX_PYRAMID, MIN_PYRAMID, POSITION, PYRAMID_LINK, PYRAMID_SOURCE
from .tree import ImageTree, build_image_tree, build_triangle_image


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    charts, level = options.get("charts", ()), options["level"]
    if level and not charts:
        raise OptionError("option level needs a geometry image, but this scene is an ordinary "
                          "mesh; make an image with gpgpu_rt.remesh(scene, size), or leave level "
                          "at 0")
    tree = build_image_tree(charts, level) if charts else build_triangle_image(triangles)
    box = np.zeros((len(tree.miss), 3), np.float32)
    fixed = {MIN_PYRAMID.name: {"lo": box, "miss": tree.miss},
             MAX_PYRAMID.name: {"hi": box, "hit": tree.hit},
             PYRAMID_SOURCE.name: {"first": tree.first, "last": tree.last}}
    roots = np.full(8, tree.root)
    if options["octants"]:
        miss, hit, roots = octant_links(tree, tree.positions(triangles))
        fixed[PYRAMID_LINK.name] = {"miss": miss.reshape(-1), "hit": hit.reshape(-1)}
    return _with_positions(Accelerator(
        fixed, {"roots": roots.tolist(), "node_count": len(tree.miss)},
        step_bound=len(tree.miss) + len(tree.corner), structure=tree,
        defines={} if charts else {"SINGLE_TRIANGLES": True},
        finisher=Pyramid(tree.levels, Precision.of(options))), triangles, level)


def _refit(accelerator: Accelerator, triangles: np.ndarray,
           options: Mapping[str, Any]) -> Accelerator:
    return _with_positions(accelerator, triangles, options["level"])


def _with_positions(accelerator: Accelerator, triangles: np.ndarray, level: int) -> Accelerator:
    tree: ImageTree = accelerator.structure
    at = tree.positions(triangles)
    if level:
        shown = np.repeat(triangles[:, :1], 3, axis=1)
        halves = shrink_flat(tree.halves(at).reshape(-1, 3, 3))
        shown[tree.face], shown[tree.face + 1] = halves[::2], halves[1::2]
    else:
        shown = triangles
    # In charts, mark the triangles without area. Single triangles need no marks: the corners of a
    # flat triangle are equal already.
    flat = tree.without_area(shown) if tree.charts else np.zeros(len(shown) + 1, bool)
    signs = [np.where(flat[tree.face + half], -1, 1) for half in (0, 1)]
    cells = {"corner": tree.corner, "across": tree.across * signs[0],
             "down": tree.down * signs[1], "face": tree.face}
    written = accelerator.tables.get(IMAGE_CELL.name)
    if written and all(np.array_equal(cells[name], written[name]) for name in cells):
        cells = written     # the tracer does not upload an unchanged object again
    lo, hi = ([float(pick(at[:, axis])) if len(at) else 0.0 for axis in range(3)]
              for pick in (np.min, np.max))
    return replace(
        accelerator, shown=shown if level else None, boxes=lambda: image_boxes(tree, at),
        uniforms={**accelerator.uniforms, "scene_lo": tuple(lo), "scene_hi": tuple(hi)},
        tables={**accelerator.tables, POSITION.name: {"at": at}, IMAGE_CELL.name: cells})


_TABLES = (POSITION, IMAGE_CELL, MIN_PYRAMID, MAX_PYRAMID, PYRAMID_SOURCE)

FAMILY = "geometry image"
ROWS = (Method(
    name="geometry-image",
    summary="traverses min and max pyramids, computed by passes, over an image of positions; an "
            "ordinary mesh becomes an image of single triangles along a Morton curve",
    citation="Carr et al. 2006",
    glsl="methods/geometry_image/geometry_image.glsl",
    kernels=("traverse", "intersect"),
    state=TREE_STATE,
    tables=_TABLES,
    prepare=_prepare,
    refit=_refit,
    options=(
        Option("level", 0, "level of detail of a geometry image: rays stop at quads of 2^level x "
               "2^level cells", int, minimum=0, label="level of detail"),
        Option("octants", False, "precompute the links in front-to-back order, once per direction "
               "octant", bool, define="FRONT_TO_BACK", label="copy per octant"),
    ),
    choose_tables=lambda options: _TABLES + ((PYRAMID_LINK,) if options["octants"] else ()),
    dynamic=True,
    fixed_defines={"IMAGE_CELLS": True},
    no_era_form="passes fill its tables in a layout that the era form does not read",
),)
