"""Pass work: the work that a method of many passes does for an image's rays.

Cells whose ``work`` is "counted passes of" and a workload measure it. Methods whose traversal is
one program are emulated instead (``period_work``). Here the fragments of each draw are counted,
and the compiler gives the number of instructions of its program. Some fragments are emulated
(``gpgpu_rt.hardware.counters``), which gives the number of loop iterations. Both sides of a branch
count.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.hardware import counters
from gpgpu_rt.hardware.cards import Card
from gpgpu_rt.hardware.model import Counted

PASSES = "counted passes of "
# An occlusion query counts only the fragments that a program keeps. These programs discard misses,
# but run on every pair of a ray and a triangle. The number says how often they run on a pair:
# tile_pairs runs once for the nearest t, and once more for the lowest index.
PAIRS = {"methods/ray_engine/quads.frag": 1, "methods/ray_tiles/tile_pairs.frag": 2}


def measure(scene: rt.Scene, rays: Workload, method: str, options: Mapping[str, Any]
            ) -> dict[str, Any]:
    """The passes of a trace, with the work of their fragments, and the bytes on the bus."""
    with rt.Tracer(scene, method, **options) as tracer:
        passes, _ = counters.counted(tracer, lambda: rays.trace(tracer))
        split, pairs = tracer.statistics.split, 0.0
        if any(one["name"] in PAIRS for one in passes):
            with tracer.counting():
                rays.trace(tracer)
            pairs = tracer.statistics.counters["triangles_tested"] * tracer.statistics.rays
    for one in passes:
        one["ran"] = PAIRS.get(one["name"], 0) * pairs or one["fragments"]
    return {"rays": rays.live, "passes": passes,
            "uploaded": split.get("bytes_up", 0), "read_back": split.get("bytes_down", 0)}


def unseen(work: Mapping[str, Any]) -> list[str]:
    """Passes whose loops could not be emulated, with their share of all fragments.

    A vertex program places the fragments of these passes. Each of their loops counts as one
    iteration, the minimum.
    """
    ran = sum(one["ran"] for one in work["passes"])
    return [f"{one['name']} ({one['ran'] / ran:.1%} of the fragments)"
            for one in work["passes"] if one["ran"] and one["loops"] and "total" not in one]


def counted(card: Card, work: Mapping[str, Any]) -> Counted:
    """The work of all passes, in the form that the model of a card expects.

    Rays and hits stay on the card. Only the transfers of a method's host part cross the bus.
    """
    kind = "scalar" if card.scalar_units else "vector"
    total = Counted(uploaded=work["uploaded"], read_back=work["read_back"])
    draws = fragments = 0.0
    for one in work["passes"]:
        if one["loops"] and "total" in one:
            times, parts = 1, [one["total"]]
        else:    # all fragments run the same; a loop that was not emulated counts one iteration
            times, parts = one["ran"], [one["once"], *one["loops"]]
        instructions = sum(part[kind] for part in parts)
        texels = sum(sum(part["fetches"].values()) for part in parts)
        bytes_each = (one["streams_read"] + one["written"]) / max(one["fragments"], 1)
        total = total + Counted(times * instructions, times * texels, one["ran"] * bytes_each)
        draws, fragments = draws + one["draws"], fragments + one["ran"]
    return total + Counted(passes=draws, pixels=fragments / max(draws, 1))
