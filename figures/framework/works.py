"""Works: lists the kinds of measurement, with a row for each kind.

If the string `work` of a cell (cell.py) begins with the name of a row, the rest of the string
names a workload or a variant. Otherwise `work` is the name of a workload, whose rays are traced
and timed.
"""
from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.accuracy.measure import Yardstick
from gpgpu_rt.bench.workloads import Workload, load, workload
from gpgpu_rt.hardware import image_issues
from gpgpu_rt.workers.machine import alone

from ..experiments import (
    bundle_errors, caustic_errors, coherence, conformance_runs, extreme_runs, first_hit_times,
    frame_times, gap_work, lost_rays, needs_times, path_errors, reduction_times, refraction_errors,
    update_times
)
from ..survey import ray_engine_work, tree_sizes
from . import trace_times
from .cell import ISSUES, ON_CHIP, Cell

COHERENCE = "coherence of "


@functools.cache
def _digest_of(name: str) -> str:
    return hashlib.sha256(rt.load_scene(name).triangles).hexdigest()


@functools.cache
def _digest_of_made(made: Any, name: str) -> str:
    return hashlib.sha256(made.scene_of(name).triangles).hexdigest()


def _of_catalogue(cell: Cell) -> str:
    return _digest_of(cell.scene)


def _of_made(made: Any) -> Callable[[Cell], str]:
    """Return a function that gives the digest of a cell's scene.

    The scene belongs to the module `made` or to the catalogue.
    """
    return lambda cell: (_digest_of_made(made, cell.scene) if cell.scene in made.MADE
                         else _digest_of(cell.scene))


@dataclass(frozen=True)
class MeasurementKind:
    """A kind of measurement, for cells whose `work` begins with `name`."""

    name: str
    measure: Callable[[Cell, str], dict[str, Any]]    # takes a cell and the rest of its `work`
    timed: bool = True          # whether times are measured, alone on the machine
    catalogued: bool = True     # whether `load_scene` knows the scene of every such cell
    # Digest of the scene's triangles. It tells a mesh from the stand-in for a missing mesh.
    digest: Callable[[Cell], str] = _of_catalogue


def _rays(cell: Cell, name: str) -> Workload:
    return workload(cell.scene, name, cell.size)


def picture_size(size: int) -> int:
    """Return the side in pixels of the pictures that an accuracy cell compares."""
    return min(256, 2 * size)


@functools.lru_cache(maxsize=1)
def _yardstick(name: str, size: int) -> Yardstick:
    side = picture_size(size)
    return Yardstick(load(name), size ** 2, size=(side, side))


def _accuracy(cell: Cell, _: str) -> dict[str, Any]:
    """Return errors against the float64 reference, and the time for the same rays."""
    row = _yardstick(cell.scene, cell.size).measure(cell.method, dict(cell.options), cell.runs,
                                                    alone)
    return {"rays": row["all"]["rays"], "warm_ups": trace_times.WARM_UPS,
            "median_ms": 1e3 * row["all"]["seconds"],
            "ns_per_ray": 1e9 / row["all"]["rays_per_second"], "accuracy": row}


def _era_counts(cell: Cell, name: str) -> dict[str, Any]:
    """Count how often a card issues each kernel. ``name``, the rest of ``cell.work``, names the
    rays and the chip."""
    rays, _, chip = name.partition(ON_CHIP)
    return {"counts": image_issues.measure(load(cell.scene), _rays(cell, rays), cell.method,
                                           dict(cell.options), chip)}


def _gap_work(kind: str) -> MeasurementKind:
    return MeasurementKind(kind, lambda cell, rays: {"gap": gap_work.measure(
        kind, load(cell.scene), _rays(cell, rays), cell.method, dict(cell.options))}, timed=False)


WORKS = (
    # Each extreme case gets size squared rays.
    MeasurementKind("extremes", lambda cell, _: {"warm_ups": 0, "cases": extreme_runs.measure(
        cell.method, dict(cell.options), cell.size ** 2)},
        timed=False, catalogued=False, digest=lambda cell: extreme_runs.digest()),
    # Each family of rays gets size squared rays.
    MeasurementKind(conformance_runs.WORK, lambda cell, _: conformance_runs.measure(
        cell.size ** 2), timed=False, catalogued=False,
        digest=lambda cell: conformance_runs.digest()),
    # The stream has size squared elements.
    MeasurementKind("reduction", lambda cell, _: {
        "warm_ups": reduction_times.WARM_UPS,
        "seconds": reduction_times.measure(cell.size ** 2, dict(cell.options)["kept"], cell.runs)},
        catalogued=False, digest=lambda cell: ""),
    # The next three rows compare rasterised approximations with traced rays.
    MeasurementKind("refraction", lambda cell, _: {
        "warm_ups": trace_times.WARM_UPS,
        "refraction": refraction_errors.measure(cell.scene, cell.method, dict(cell.options),
                                                cell.size, cell.runs)},
                    catalogued=False,
                    digest=lambda cell: "" if cell.scene == "ball" else _of_catalogue(cell)),
    MeasurementKind("caustics", lambda cell, _: {
        "warm_ups": trace_times.WARM_UPS,
        "caustics": caustic_errors.measure(cell.scene, cell.method, dict(cell.options),
                                           cell.size, cell.runs)},
                    catalogued=False, digest=_of_made(caustic_errors)),
    MeasurementKind("ray bundles", lambda cell, _: {
        "warm_ups": trace_times.WARM_UPS,
        "bundles": bundle_errors.measure(cell.scene, cell.method, dict(cell.options),
                                         cell.size, cell.runs)},
                    catalogued=False, digest=_of_made(bundle_errors)),
    MeasurementKind("first hits", lambda cell, _: {"first_hits": first_hit_times.measure(
        load(cell.scene), cell.method, dict(cell.options), cell.size, cell.runs)}),
    # Measures errors after 64, 128, ... samples, up to the number in the options.
    MeasurementKind("path errors", lambda cell, _: {"errors": path_errors.measure(
        load(cell.scene), cell.method, dict(cell.options), cell.size)}, timed=False),
    # The option `step` is the number of a scene of experiments/growing.py.
    MeasurementKind("needs", lambda cell, _: {"needs": needs_times.measure(
        dict(cell.options)["step"], cell.method, cell.size, cell.runs, cell.scene)},
        digest=lambda cell: needs_times.digest(cell.scene, dict(cell.options)["step"])),
    # Traces size squared rays of each kind (`accuracy.known_rays`), and judges their hits.
    MeasurementKind("accuracy", _accuracy),
    # Sizes of the kd-tree that the options describe.
    MeasurementKind("tree", lambda cell, _: {"tree": tree_sizes.measure(
        load(cell.scene), dict(cell.options))}, timed=False),
    MeasurementKind("updates", lambda cell, _: {"updates": update_times.measure(
        load(cell.scene), cell.method, dict(cell.options), cell.runs)}),
    # Traces the eye rays of `runs` frames of a scene.
    MeasurementKind("frames", lambda cell, _: {"frames": frame_times.measure(
        cell.scene, cell.method, dict(cell.options), cell.size, cell.runs)}),
    MeasurementKind(COHERENCE, lambda cell, rays: {"coherence": coherence.measure(
        load(cell.scene), _rays(cell, rays))}, timed=False),
    MeasurementKind(ISSUES, _era_counts, timed=False),
    MeasurementKind(lost_rays.WORK, lambda cell, _: {"numbers": lost_rays.measure(
        load(cell.scene), cell.method, dict(cell.options), cell.size)}, timed=False),
    MeasurementKind(ray_engine_work.WORK, lambda cell, rays: {"engine": ray_engine_work.measure(
        load(cell.scene), _rays(cell, rays), dict(cell.options))}, timed=False),
    *map(_gap_work, gap_work.KINDS),
)
TRACED = MeasurementKind("", lambda cell, _: trace_times.measure(cell))


def work_of(cell: Cell) -> MeasurementKind:
    """Return the row of WORKS that a cell's `work` names; TRACED if `work` names a workload."""
    return next((work for work in WORKS if cell.work.startswith(work.name)), TRACED)
