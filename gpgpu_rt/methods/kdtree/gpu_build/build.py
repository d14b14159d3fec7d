"""Build a kd-tree by fragment passes."""
from __future__ import annotations

import numpy as np

from ....accel.bounds import as_triangles
from ....accel.options import choose
from ....errors import LimitError
from ....gl.algorithms.streams import StreamRoom
from ....gl.context import Gpu
from ....gl.record import EXACT_INTEGER
from ..build import build_kdtree as build_on_cpu
from ..tree import KdTree
from . import hybrid as hybrid_kdtree
from . import zhou

GPU_KD_BUILDS = {"zhou": zhou.build, "hybrid": hybrid_kdtree.build}


def build_kdtree_by_passes(gpu: Gpu, triangles: np.ndarray, *, build: str = "zhou",
                           **options: object) -> KdTree:
    """Build a kd-tree by fragment passes.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    build : a name in GPU_KD_BUILDS
    options : options of the CPU builder with the same name

    Raises
    ------
    OptionError, SceneError
    LimitError
        if a float texel cannot index all triangles exactly
    """
    builder = GPU_KD_BUILDS[choose("build on the gpu", build, GPU_KD_BUILDS)]
    triangles = as_triangles(triangles)
    if len(triangles) > EXACT_INTEGER:
        raise LimitError(f"{len(triangles):,} triangles are more than 2^24, the largest index "
                         "that a float texel holds exactly; build on the cpu")
    if len(triangles) == 0:
        return build_on_cpu(triangles, build=build, **options)
    with gpu, StreamRoom(gpu, "methods/kdtree/build") as room:
        tree = builder(room, triangles, **options)
        gpu.check_error(f"building a kd-tree of {len(triangles):,} triangles")
    return tree
