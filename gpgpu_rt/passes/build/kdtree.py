"""Kd-trees built on the GPU, as the record that CPU builders make."""
from __future__ import annotations

import numpy as np

from ...accel.bounds import as_triangles
from ...accel.kdtree import KdTree
from ...accel.kdtree import build_kdtree as build_on_cpu
from ...accel.options import choose
from ...errors import LimitError
from ...gpu import Gpu
from ...record import EXACT_INTEGER
from ..streams import StreamRoom
from . import hybrid_kdtree, zhou

GPU_KD_BUILDS = {"zhou": zhou.build, "hybrid": hybrid_kdtree.build}


def build_kdtree(gpu: Gpu, triangles: np.ndarray, *, build: str = "zhou",
                 **options: object) -> KdTree:
    """Build a kd-tree by fragment passes.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    build : a name in GPU_KD_BUILDS
    options : of that builder, those of its CPU counterpart in `accel`

    Raises
    ------
    OptionError, SceneError, LimitError
    """
    builder = GPU_KD_BUILDS[choose("build on the gpu", build, GPU_KD_BUILDS)]
    triangles = as_triangles(triangles)
    if len(triangles) > EXACT_INTEGER:
        raise LimitError(f"{len(triangles):,} triangles are past 2^24, the last index a float "
                         "texel holds exactly; build on the cpu")
    if len(triangles) == 0:
        return build_on_cpu(triangles, build=build, **options)
    with gpu, StreamRoom(gpu) as room:
        tree = builder(room, triangles, **options)
        gpu.check_error(f"building a kd-tree of {len(triangles):,} triangles")
    return tree
