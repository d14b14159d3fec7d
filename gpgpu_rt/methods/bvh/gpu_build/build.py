"""Build a bounding volume hierarchy (`Bvh`) by fragment passes."""
from __future__ import annotations

import numpy as np

from ....accel.bounds import as_triangles
from ....accel.options import choose
from ....errors import LimitError
from ....gl.algorithms.streams import StreamRoom
from ....gl.context import Gpu
from ....gl.record import EXACT_INTEGER
from ..tree import Bvh, LooseTree
from . import hybrid, lbvh, sah

GPU_BUILDS = {"sah": sah.build, "lbvh": lbvh.build, "hybrid": hybrid.build}


def build_bvh_by_passes(gpu: Gpu, triangles: np.ndarray, *, build: str = "sah",
                        **options: object) -> Bvh:
    """Build a bounding volume hierarchy by fragment passes.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    build : a name in GPU_BUILDS
    options : options of the CPU builder with the same name

    Raises
    ------
    OptionError, SceneError
    LimitError
        if a float texel cannot index all triangles or nodes exactly
    """
    builder = GPU_BUILDS[choose("build on the gpu", build, GPU_BUILDS)]
    triangles = as_triangles(triangles)
    if len(triangles) > EXACT_INTEGER:
        raise LimitError(f"{len(triangles):,} triangles are more than 2^24, the largest index "
                         "that a float texel holds exactly; build on the cpu")
    if len(triangles) == 0:
        empty = np.zeros(0, np.int64)
        return LooseTree(empty, empty, empty, empty).thread(triangles)
    with gpu, StreamRoom(gpu, "methods/bvh/build") as room:
        bvh = builder(room, triangles, **options)
        gpu.check_error(f"building a hierarchy of {len(triangles):,} triangles")
    return bvh
