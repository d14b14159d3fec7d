"""Build a kd-tree by one of the builders."""
from __future__ import annotations

import numpy as np

from ...accel.bounds import as_triangles, scene_box
from ...accel.options import choose
from ...gl.record import EXACT_INTEGER
from . import hybrid, sah_build, zhou
from .tree import KdTree

BUILDERS = {"sah": sah_build.build, "zhou": zhou.build, "hybrid": hybrid.build}


def build_kdtree(triangles: np.ndarray, *, build: str = "sah", **options: object) -> KdTree:
    """Build a kd-tree.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    build : "sah", "zhou" or "hybrid"
    options : options of the builder: see `sah_build.build`, `zhou.build`, `hybrid.build`

    Raises
    ------
    OptionError, SceneError
    """
    builder = BUILDERS[choose("build", build, BUILDERS)]
    triangles = as_triangles(triangles)
    # Textures store indices as floats, which are exact only up to EXACT_INTEGER.
    tree = builder(triangles, **options).coarsened(EXACT_INTEGER)
    return tree.finish(*scene_box(triangles))
