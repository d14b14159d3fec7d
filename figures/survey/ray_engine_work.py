"""Ray Engine work: counts the work of Carr et al.'s Ray Engine on a card, and predicts the time.

A cell (framework/cell.py) asks for this count if its ``work`` is WORK + a workload's name. The
host collects pairs of a ray and a triangle, and the card tests each pair. Only the card's time is
predicted.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.gl.pass_log import logged
from gpgpu_rt.hardware.cards import Card
from gpgpu_rt.hardware.issue import KernelIssues
from gpgpu_rt.hardware.machine_model import time_of_passes
from gpgpu_rt.hardware.static_costs import static_cost
from gpgpu_rt.statistics import Statistics

METHOD, WORK = "ray-engine", "ray engine's work for "
# The Ray Engine has no era form (docs/era.md). Its costs are those of brute force's kernel, which
# also tests one triangle. But the Ray Engine's kernel writes one target and fetches only the ray's
# two texels, because the paper's quad carries the triangle's corners.
KERNEL, FETCHES, TARGETS = ("brute-force", "intersect"), 2, 1


def measure(scene: rt.Scene, rays: Workload, options: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of ray-triangle pairs, of draws, and of bytes on the bus.

    The depth test keeps the nearest hit, as in the paper, so each pair is drawn once. With MIN
    blending, the default, each pair is drawn twice.
    """
    with rt.Tracer(scene, METHOD, **{**options, "nearest": "depth"}) as tracer:
        with tracer.gpu, logged(tracer.gpu, Statistics()) as log:
            rays.trace(tracer)
        split = tracer.statistics.split
    return {"rays": rays.live, "pairs": split["pairs"],
            "draws": sum(one.draws for one in log.passes.values()),
            "uploaded": split["bytes_up"], "read_back": split["bytes_down"]}


def predicted_seconds(card: Card, work: Mapping[str, float]) -> tuple[float, str]:
    """Return the card's seconds for measured work, and what takes most of the time."""
    method, kernel = KERNEL
    pairs = round(work["pairs"])
    issued = KernelIssues((kernel,), (pairs,), (pairs,), passes=(round(work["draws"]),))
    # A quad covers only rays that are paired with its triangle, so early depth rejects no pixel.
    cost = replace(static_cost(card.chip.lower(), method, kernel), fetches=FETCHES,
                   targets=TARGETS)
    time = time_of_passes(card, issued, {kernel: cost}, {kernel: FETCHES}, pixels=0)
    moved = work["uploaded"] / card.upload + work["read_back"] / card.readback
    parts = {**time.parts, "transfers": moved}
    return sum(parts.values()), max(parts, key=parts.__getitem__)
