"""The build options of all BVH methods, and the function that builds a tree with these options."""
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
from .hybrid import CLUSTER_BITS
from .lbvh import AXIS_BITS
from .tree import Bvh

BUILD_OPTIONS = (
    Option("build", "sah", "builder of the tree",
           choices=("sah", "kay-kajiya", "goldsmith-salmon", "lbvh", "hybrid"),
           label="tree builder"),
    Option("build_device", "cpu", "cpu builds the tree with numpy on the host; gpu builds it with "
           "fragment passes, and needs build=sah, build=lbvh or build=hybrid",
           choices=("cpu", "gpu"), label="build on"),
    Option("morton_bits", None, "bits per axis of the Morton codes of the builds lbvh and hybrid; "
           "default: 10 for lbvh, 2 for hybrid", int, minimum=1,
           goes_with=("build", ("lbvh", "hybrid")), label="Morton code bits"),
    Option("reinsertion", 0, "rounds of optimisation after the build, in which subtrees move to "
           "the place in the tree where they cost least", int, minimum=0, maximum=MOST_ROUNDS,
           tried=(3,),
           goes_with=("build_device", ("cpu",)), label="optimisation rounds"),
)


def automatic_values(options: Mapping[str, Any]) -> dict[str, int]:
    """Return a dict: option -> the value that `built_bvh` uses if the option is None."""
    bits = {"lbvh": AXIS_BITS, "hybrid": CLUSTER_BITS}.get(options["build"])
    return {} if bits is None else {"morton_bits": bits}


def built_bvh(triangles: np.ndarray, options: Mapping[str, Any], **limit: int) -> Bvh:
    """Build the tree by a method's options. A tree built on the CPU may come from the cache.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    options : resolved options, including those of BUILD_OPTIONS and the tracer's ``context``
    limit : the arguments that `node_limit` (build.py) returns

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
        raise OptionError(f"build {build} cannot run on the GPU; with build_device=gpu, build is "
                          f"one of {', '.join(GPU_BUILDS)}")
    if limit:
        raise LimitError(f"a tree of {len(triangles):,} triangles would have more nodes than "
                         "floats can index; build on the cpu, which makes larger leaves")
    return build_bvh_by_passes(open_gpu(options["context"]), triangles, **chosen)
