"""The build options of all kd-tree methods, and the function that builds a tree with them."""
from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...errors import OptionError
from ...gl.context import open_gpu
from ...options import Option
from .build import build_kdtree
from .gpu_build.build import GPU_KD_BUILDS, build_kdtree_by_passes
from .hybrid import MORTON_BITS
from .sah import Costs
from .tree import KdTree, depth_cap

BUILD_OPTIONS = (
    Option("build", "sah", "builder of the tree: sah uses the surface area heuristic for all "
           "nodes, zhou splits large nodes in the middle, hybrid builds the upper levels from "
           "Morton codes",
           choices=("sah", "zhou", "hybrid"), label="tree builder"),
    Option("build_device", "cpu", "cpu builds the tree with numpy on the host; gpu builds it with "
           "fragment passes, and needs build=zhou or build=hybrid",
           choices=("cpu", "gpu"), label="build on"),
    Option("split", "binned", "candidate split planes of the builds sah and hybrid",
           choices=("binned", "exact"), goes_with=("build", ("sah", "hybrid")),
           label="split planes"),
    Option("morton_bits", None, "bits per axis of the Morton codes of the build hybrid; default: "
           "2", int, minimum=1, goes_with=("build", ("hybrid",)), label="Morton code bits"),
    Option("workers", 1, "number of processes of the build sah", int, minimum=1,
           goes_with=("build", ("sah",)), label="build processes"),
    Option("traversal_cost", Costs.traversal, "cost of a node in the surface area heuristic",
           float, minimum=0, label="cost of a node"),
    Option("intersection_cost", Costs.intersection, "cost of a triangle in the surface area "
           "heuristic, in the same unit", float, minimum=1e-6, label="cost of a triangle"),
    Option("empty_bonus", Costs.empty_bonus, "share by which the cost of a split is reduced if "
           "the empty space that it cuts off is at least a fifth of the node", float, minimum=0,
           label="bonus for empty space"),
    Option("max_depth", None, "largest depth of a leaf; default: 8 + 1.3 log2 of the number of "
           "triangles, and 16 more for the build zhou", int, minimum=0, label="deepest level"),
)


def automatic_values(triangles: np.ndarray, options: Mapping[str, Any]) -> dict[str, int]:
    """Return option -> the value that `built_kdtree` uses if the option is None.

    The result for the build zhou is empty: its default is a pair of limits (`zhou.rules_of`),
    which no single ``max_depth`` can express.
    """
    if options["build"] == "zhou":
        return {}
    return {"max_depth": depth_cap(triangles, None), "morton_bits": MORTON_BITS}


def built_kdtree(triangles: np.ndarray, options: Mapping[str, Any]) -> KdTree:
    """Build the tree by a method's options. A tree built on the CPU may come from the cache.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    options : resolved options, including those of BUILD_OPTIONS and the tracer's ``context``

    Raises
    ------
    OptionError, SceneError, LimitError
    """
    build = options["build"]
    chosen = {option.name: options[option.name] for option in BUILD_OPTIONS
              if option.fits(options) and options[option.name] is not None}
    device = chosen.pop("build_device")
    if device == "gpu":
        if build not in GPU_KD_BUILDS:
            raise OptionError(f"build {build} of a kd-tree cannot run on the GPU; with "
                              f"build_device=gpu, build is one of {', '.join(GPU_KD_BUILDS)}")
        return build_kdtree_by_passes(open_gpu(options["context"]), triangles, **chosen)
    if "workers" not in chosen:
        return cached(build_kdtree, triangles, **chosen)
    # The cache's key has no number of workers: all numbers give the same tree, unless the limit
    # MOST_REFERENCES stops the growth of subtrees (shevtsov.py).
    parallel = functools.update_wrapper(
        functools.partial(build_kdtree, workers=chosen.pop("workers")), build_kdtree)
    return cached(parallel, triangles, **chosen)
