"""What a method that runs in many passes does to an image's rays: cells of "passes of" a workload.

Methods whose traversal is one program are emulated instead (``period_work``). Here fragments are
counted draw by draw, and their programs' instructions taken from the compiler; both sides of a
branch count.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.hardware.cards import Card
from gpgpu_rt.hardware.counters import pass_counts
from gpgpu_rt.hardware.model import Counted

PASSES = "passes of "
# An occlusion query counts the fragments that a program keeps. These discard misses: they ran on
# every pair of a ray and a triangle, in so many draws under one program (nearest t, lowest index).
PAIRS = {"passes/quads.frag": 1, "passes/tile_pairs.frag": 2}
# Passes that there are for statistics alone.
COUNTERS = {"passes/pair_visits.frag", "passes/visits_below.frag"}
# Turns of a program's loops for a fragment: a tile's rays; the half of a block on average, a
# search through one, its sum; the values that a reduction takes together.
TURNS = {"tile_": 64, "block_ranks": 8, "segments": 4, "reduce": 7, "scan": 4}


def measure(scene: rt.Scene, rays: Workload, method: str, options: Mapping[str, Any]
            ) -> dict[str, Any]:
    """The passes of a trace with what their fragments do, and what crossed the bus."""
    with rt.Tracer(scene, method, **options, statistics=True) as tracer:
        rays.trace(tracer)
        found, log = tracer.statistics, tracer.pass_log
        assert log is not None
        pairs = found.counters["triangles_tested"] * found.rays
        passes = [{**entry, "ran": PAIRS.get(entry["name"], 0) * pairs or entry["fragments"]}
                  for entry, one in zip(pass_counts(log), log.passes.values())
                  if entry["name"] not in COUNTERS and "#define COUNTING" not in one.texts[1]]
    split = found.split
    return {"rays": rays.live, "passes": passes,
            "uploaded": split.get("bytes_up", 0), "read_back": split.get("bytes_down", 0)}


def counted(card: Card, work: Mapping[str, Any]) -> Counted:
    """All passes as the model of a card takes them. Rays come and hits stay on the card; what
    crosses the bus is what the host's share of a method moves."""
    kind = "scalar" if card.scalar_units else "vector"
    total = Counted(uploaded=work["uploaded"], read_back=work["read_back"])
    draws = fragments = 0.0
    for one in work["passes"]:
        turns = next((n for word, n in TURNS.items() if word in one["name"]), 1)
        parts = [(1, one["once"]), *((turns, loop) for loop in one["loops"])]
        instructions, texels = (sum(n * value(part) for n, part in parts) for value in (
            lambda part: part[kind], lambda part: sum(part["fetches"].values())))
        bytes_each = (one["streams_read"] + one["written"]) / max(one["fragments"], 1)
        total = total + Counted(one["ran"] * instructions, one["ran"] * texels,
                                one["ran"] * bytes_each)
        draws, fragments = draws + one["draws"], fragments + one["ran"]
    return total + Counted(passes=draws, pixels=fragments / max(draws, 1))
