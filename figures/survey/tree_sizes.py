"""Tree sizes: computes a kd-tree's size without and with ropes, as in Popov et al. 2007."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.methods.kdtree.ropes import build_ropes
from gpgpu_rt.methods.quality import quality

NODE_BYTES, REFERENCE_BYTES = 8, 4   # these numbers and Ropes.bytes give the sizes of Figure 17


def measure(scene: rt.Scene, options: Mapping[str, Any]) -> dict[str, float]:
    """Return counts and bytes of the kd-tree that is built with ``options``.

    ``bytes`` covers nodes and references. ``bytes_ropes`` adds six ropes and a box in every leaf.
    ``overhead`` is ``bytes_ropes`` / ``bytes``.
    """
    with rt.Tracer(scene, "kd-restart", **options) as tracer:
        tree = tracer.accelerator.structure
    found = quality(tree)
    bare = NODE_BYTES * found["nodes"] + REFERENCE_BYTES * found["references"]
    with_ropes = bare + build_ropes(tree, push_down=False).bytes
    return {**found, "bytes": bare, "bytes_ropes": with_ropes, "overhead": with_ropes / bare}
