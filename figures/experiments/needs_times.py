"""Needs times: the costs of a renderer derived from its scene, and of a renderer with all features
on."""
from __future__ import annotations

import hashlib
import statistics
import time
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.workers.machine import alone

from .growing import scenes

COUNTS = ("texture_bytes", "texel_fetches", "waves", "passes")
LIGHT_SAMPLES, BOUNCES = 4, 4


def digest(name: str, step: int) -> str:
    """A digest of the scene of a step (growing.py): of its triangles, its camera, its lights, and
    the names and diffuse colours of its materials."""
    scene = scenes(name)[step]
    said = (scene.camera, scene.lights, [(m.name, m.diffuse) for m in scene.materials])
    return hashlib.sha256(scene.triangles.tobytes() + repr(said).encode()).hexdigest()


def measure(step: int, method: str, size: int, runs: int, name: str = "bunny") -> dict[str, Any]:
    """Draw ``runs`` pairs of pictures of a step's scene. The two kinds of renderer alternate.

    Returns
    -------
    dict
        "derived" and "all" have, for each kind of renderer, the median ``seconds``, each of COUNTS
        and ``passes_by_name``. ``ratio`` is the median, over the pairs, of the derived renderer's
        seconds divided by the other renderer's. ``differing`` is the number of pixels that differ.
        ``present`` has the names of the properties that the derived renderer supports.
    """
    scene = scenes(name)[step]
    kinds = {"derived": False, "all": True}
    tracers = {kind: rt.Tracer(scene, method) for kind in kinds}
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    pictures = {}

    def once(turn: int) -> None:
        for kind in kinds if turn % 2 else reversed(kinds):
            began = time.perf_counter()
            pictures[kind] = np.asarray(tracers[kind].render(
                size=(size, size), all_features=kinds[kind], light_samples=LIGHT_SAMPLES,
                bounces=BOUNCES))
            if turn:
                seconds[kind].append(time.perf_counter() - began)
    once(0)
    with alone():
        for turn in range(1, 1 + runs):
            once(turn)
    costs = {kind: tracer.statistics.to_dict() for kind, tracer in tracers.items()}
    plan = tracers["derived"].plan((size, size), light_samples=LIGHT_SAMPLES, bounces=BOUNCES)
    for tracer in tracers.values():
        tracer.release()
    return {**{kind: {"seconds": statistics.median(seconds[kind]),
                      "passes_by_name": costs[kind]["picture_passes"],
                      **{count: costs[kind][count] for count in COUNTS}} for kind in kinds},
            "ratio": statistics.median(a / b for a, b in zip(seconds["derived"], seconds["all"])),
            "present": plan.present,
            "differing": int((pictures["derived"] != pictures["all"]).any(axis=2).sum())}
