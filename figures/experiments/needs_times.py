"""Needs times: measures the costs of two renderers on the same scene.

The derived renderer has only the features that the scene needs; the other has all features. A step
is the number of a scene in growing.py.
"""
from __future__ import annotations

import hashlib
import statistics
import time
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.workers.machine import alone

from .growing import scenes

COUNTS = ("texture_bytes", "texel_fetches", "waves", "passes")
LIGHT_SAMPLES, BOUNCES = 4, 4


def digest(name: str, step: int) -> str:
    """Return a digest of all fields of the step's scene."""
    found = hashlib.sha256()
    _add(found, scenes(name)[step])
    return found.hexdigest()


def _add(found: Any, value: Any) -> None:
    if is_dataclass(value):
        for part in fields(value):
            _add(found, getattr(value, part.name))
    elif isinstance(value, tuple):
        found.update(f"{len(value)} parts;".encode())
        for part in value:
            _add(found, part)
    elif isinstance(value, np.ndarray):
        found.update(repr((value.shape, value.dtype.str)).encode() + value.tobytes())
    else:
        found.update(f"{value!r};".encode())


def measure(step: int, method: str, size: int, runs: int, name: str = "bunny") -> dict[str, Any]:
    """Draw ``runs`` pairs of pictures of a step's scene, alternating the two renderers.

    Returns
    -------
    dict
        "derived" and "all" hold the costs of the two renderers: the median ``seconds``, each of
        COUNTS, and ``passes_by_name``. ``ratio`` is the derived renderer's time divided by
        the other's, as a median over the pairs. ``differing`` is the number of differing pixels.
        ``present`` names the properties that the derived renderer supports.
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
