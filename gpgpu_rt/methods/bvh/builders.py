"""The build options that all BVH methods share, and the build that they select."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...errors import LimitError, OptionError
from ...gl.context import open_gpu
from ...options import Option
from .build import MOST_ROUNDS, build_bvh
from .gpu_build.build import GPU_BUILDS, build_bvh_by_passes
from .tree import Bvh

BUILD_OPTIONS = (
    Option("build", "sah", "who builds the tree",
           choices=("sah", "kay-kajiya", "goldsmith-salmon", "lbvh", "hybrid")),
    Option("build_device", "cpu", "what builds it: numpy, or fragment passes (not kay-kajiya, nor "
           "goldsmith-salmon)", choices=("cpu", "gpu")),
    Option("morton_bits", None, "bits of an axis in the codes that lbvh sorts by, or in "
           "those that hybrid makes clusters of; none: 10, and 2", int, minimum=1,
           goes_with=("build", ("lbvh", "hybrid"))),
    Option("reinsertion", 0, "rounds in which all subtrees of what was built look for the place "
           "where they cost least", int, minimum=0, maximum=MOST_ROUNDS,
           goes_with=("build_device", ("cpu",))),
)


def built_bvh(triangles: np.ndarray, options: Mapping[str, Any], **limit: int) -> Bvh:
    """Build the tree that a method's options select; the cache may supply a tree from the CPU.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    options : resolved options, including those of BUILD_OPTIONS and the tracer's ``context``
    limit : see `node_limit`

    Raises
    ------
    OptionError, SceneError, LimitError
    """
    build, device, bits = (options[name] for name in ("build", "build_device", "morton_bits"))
    chosen = {"build": build}
    if bits is not None:
        chosen["morton_bits"] = bits
    if options["reinsertion"]:
        chosen["reinsertion"] = options["reinsertion"]
    if device == "cpu":
        return cached(build_bvh, triangles, **chosen, **limit)
    if build not in GPU_BUILDS:
        raise OptionError(f"build {build} has no passes; the gpu builds {', '.join(GPU_BUILDS)}")
    if limit:
        raise LimitError(f"a tree of {len(triangles):,} triangles would have more nodes than "
                         "floats can index; build it on the cpu, where leaves then hold more")
    return build_bvh_by_passes(open_gpu(options["context"]), triangles, **chosen)
