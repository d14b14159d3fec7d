"""Measuring: runs cells and keeps each as a JSON file; figures only read those.

A cell that was finished with the same settings on the same renderer is not measured again.
"""
from __future__ import annotations

import datetime
import functools
import hashlib
import importlib.metadata
import json
import statistics
import subprocess
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

import gpgpu_rt as rt
from gpgpu_rt.accuracy.measure import Yardstick
from gpgpu_rt.bench.engines import EMBREE as ONE_THREAD
from gpgpu_rt.bench.engines import ENGINES
from gpgpu_rt.bench.workloads import EYE, Workload, load, workload
from gpgpu_rt.files import replacing
from gpgpu_rt.gpu import open_gpu

from . import (
    coherence, extreme_runs, first_hit_times, frame_times, gap_work, needs_times, period_work,
    reduction_times, refraction_errors, tree_sizes
)

WARM_UPS = 1
COHERENCE = "coherence of "   # then a workload: how alike its rays are
EMBREE = "embreex"   # stands as a method for embreex on one thread of the CPU


@dataclass(frozen=True)
class Cell:
    """One measurement: a method with options on a scene, and what it is to do there."""

    scene: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()
    size: int = 256
    work: str = EYE            # a workload; "picture": eye rays, shading, shadow rays; "tree":
    #                            what a kd-tree holds; "frames": `runs` frames of a scene that
    #                            moves; "accuracy": size squared rays of each kind
    #                            of `known_rays`, judged;
    #                            "refraction": of a closed scene, or "ball";
    #                            "first hits": eye rays, rasterised and traced;
    #                            "needs": pictures of a step of `growing`;
    #                            "work of" a workload: what period hardware would do;
    #                            "reduction": size squared elements of a stream
    runs: int = 5

    @property
    def name(self) -> str:
        """The name of its file."""
        words = [self.scene, self.method, *(f"{k}={v}" for k, v in self.options),
                 f"{self.size}x{self.size}", self.work]
        return "".join(c if c.isalnum() or c in "=.-" else "_" for c in "-".join(words)) + ".json"


def settings(cell: Cell) -> dict[str, Any]:
    """What must be equal for a finished cell to count."""
    return {**asdict(cell), "options": dict(cell.options), "renderer": open_gpu().renderer,
            "scene_sha256": (needs_times.digest(cell.scene, dict(cell.options)["step"])
                             if cell.work == "needs" else _scene_digest(cell.scene)),
            "version": importlib.metadata.version("gpgpu_rt")}


def read(cell: Cell, data: Path) -> dict[str, Any] | None:
    """A finished cell, or None: not there, damaged, or of other settings."""
    try:
        result = json.loads((data / cell.name).read_text())
        return result if result["settings"] == json.loads(json.dumps(settings(cell))) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def measure(cells: Iterable[Cell], data: Path, again: bool = False) -> None:
    """Measure every cell that is not finished, in order, each written when it is done."""
    data.mkdir(parents=True, exist_ok=True)
    todo = [cell for cell in dict.fromkeys(cells) if again or read(cell, data) is None]
    with tqdm(todo, unit="cell", dynamic_ncols=True) as progress:
        for cell in progress:
            options = " ".join(f"{k}={v}" for k, v in cell.options)
            progress.set_description(f"{cell.scene} {cell.method} {options}".strip())
            result = run(cell)
            with replacing(data / cell.name) as path:
                path.write_text(json.dumps(result, indent=1, default=str))


def run(cell: Cell) -> dict[str, Any]:
    """Measure one cell: warm-ups, timed runs without counters, then counters in a run apart."""
    if cell.work == "extremes":
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": _commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": 0,
                "cases": extreme_runs.measure(cell.method, dict(cell.options), cell.size ** 2)}
    if cell.work == "reduction":
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": _commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": reduction_times.WARM_UPS,
                "seconds": reduction_times.measure(cell.size ** 2, dict(cell.options)["kept"],
                                                   cell.runs)}
    if cell.work == "needs":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "needs": needs_times.measure(dict(cell.options)["step"], cell.method, cell.size,
                                             cell.runs, cell.scene)}
    if cell.work == "accuracy":
        return _run_accuracy(cell)
    if cell.work == "tree":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "tree": tree_sizes.measure(load(cell.scene), dict(cell.options))}
    if cell.work.startswith(COHERENCE):
        rays = workload(cell.scene, cell.work.removeprefix(COHERENCE), cell.size)
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "coherence": coherence.measure(load(cell.scene), rays)}
    if cell.work.startswith(period_work.WORK):
        return _run_work(cell)
    if cell.work.startswith(gap_work.KINDS):
        kind = next(kind for kind in gap_work.KINDS if cell.work.startswith(kind))
        rays = workload(cell.scene, cell.work.removeprefix(kind), cell.size)
        return {**_heading(cell, load(cell.scene), open_gpu().info()), "gap": gap_work.measure(
            kind, load(cell.scene), rays, cell.method, dict(cell.options))}
    if cell.work == "frames":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "frames": frame_times.measure(cell.scene, cell.method, dict(cell.options),
                                              cell.size, cell.runs)}
    if cell.work == "refraction":
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": _commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": WARM_UPS,
                "refraction": refraction_errors.measure(
                    cell.scene, cell.method, dict(cell.options), cell.size, cell.runs)}
    if cell.work == "first hits":
        scene = load(cell.scene)
        return {**_heading(cell, scene, open_gpu().info()),
                "first_hits": first_hit_times.measure(scene, cell.method, dict(cell.options),
                                                      cell.size, cell.runs)}
    if cell.method == EMBREE:
        return _run_embree(cell)
    scene = load(cell.scene)
    rays = workload(cell.scene, EYE if cell.work == "picture" else cell.work, cell.size)
    samples, walls, sorts = [], [], []
    with rt.Tracer(scene, cell.method, **dict(cell.options)) as tracer:
        for turn in range(WARM_UPS + cell.runs):
            began = time.perf_counter()
            if cell.work == "picture":
                tracer.render(size=(cell.size, cell.size))
            else:
                _trace(rays, tracer)
            wall = time.perf_counter() - began
            if turn >= WARM_UPS:
                samples.append(tracer.statistics.trace_seconds)
                walls.append(wall)
                sorts.append(tracer.statistics.sort_seconds)
        cost = tracer.statistics.to_dict()
        gpu = tracer.gpu.info()
    with rt.Tracer(scene, cell.method, **dict(cell.options), statistics=True) as tracer:
        _trace(rays, tracer)
        driver = tracer.statistics.driver
        # Pixels without a ray count nothing by themselves, and each of a packet what all do.
        width, height = tracer.options.get("packet", (1, 1))
        share = cell.size ** 2 / (max(rays.live, 1) * width * height)
        counters = {name: share * mean for name, mean in tracer.statistics.counters.items()}
    return {**_heading(cell, scene, gpu), **_timing(samples, walls, rays.live),
            "sort_ms": 1e3 * statistics.median(sorts), "statistics": cost, "counters": counters,
            "driver": driver}


def _trace(rays: Workload, tracer: rt.Tracer) -> None:
    """Trace a workload; eye rays that bounds are asked for, by the camera they come from."""
    if tracer.options["rasterised_bounds"]:
        tracer.eye_hits(size=(rays.size, rays.size))
    else:
        rays.trace(tracer)


def _timing(samples: list[float], walls: list[float], rays: int) -> dict[str, Any]:
    median = statistics.median(samples)
    return {"rays": rays, "warm_ups": WARM_UPS, "samples_ms": [1e3 * s for s in samples],
            "median_ms": 1e3 * median, "wall_ms": 1e3 * statistics.median(walls),
            "ns_per_ray": 1e9 * median / max(rays, 1)}


def _run_embree(cell: Cell) -> dict[str, Any]:
    """Eye rays by embreex; what it counts inside is not known."""
    scene, rays = load(cell.scene), workload(cell.scene, cell.work, cell.size)
    engine = next(one for one in ENGINES if one.name == ONE_THREAD)
    if engine.missing:
        raise rt.Error(f"{engine.missing} is not installed; run `make setup`")
    run, samples = engine.prepare(scene, rays.compact()), []
    for turn in range(WARM_UPS + cell.runs):
        began = time.perf_counter()
        run()
        if turn >= WARM_UPS:
            samples.append(time.perf_counter() - began)
    return {**_heading(cell, scene, open_gpu().info()), **_timing(samples, samples, rays.live),
            "statistics": {}, "counters": {}}


def _heading(cell: Cell, scene: rt.Scene, gpu: dict[str, Any]) -> dict[str, Any]:
    """What every result begins with: of what, on what, when."""
    return {"settings": settings(cell), "gpu": gpu, "commit": _commit(),
            "date": datetime.date.today().isoformat(),
            "scene": {"name": scene.name, "triangles": len(scene), "stand_in": scene.stand_in,
                      "file": Path(scene.source).name, "camera": scene.camera.to_dict()}}


def _run_work(cell: Cell) -> dict[str, Any]:
    """Count what period hardware would have to do for the rays of a cell."""
    name = cell.work.removeprefix(period_work.WORK)
    manner = next((m for m in (period_work.SQUARES, period_work.KERNELS) if name.endswith(m)), "")
    rays = workload(cell.scene, name.removesuffix(manner), cell.size)
    return {**_heading(cell, load(cell.scene), open_gpu().info()),
            "work": period_work.measure(load(cell.scene), rays, cell.method, dict(cell.options),
                                        manner)}


def _run_accuracy(cell: Cell) -> dict[str, Any]:
    """Measure one cell's errors against the float64 reference, and its time on the same rays."""
    row = _yardstick(cell.scene, cell.size).measure(cell.method, dict(cell.options), cell.runs)
    return {**_heading(cell, load(cell.scene), open_gpu().info()), "rays": row["all"]["rays"],
            "warm_ups": WARM_UPS, "median_ms": 1e3 * row["all"]["seconds"],
            "ns_per_ray": 1e9 / row["all"]["rays_per_second"], "accuracy": row}


@functools.lru_cache(maxsize=1)
def _yardstick(name: str, size: int) -> Yardstick:
    return Yardstick(load(name), size ** 2)


@functools.cache
def _scene_digest(name: str) -> str:
    """Tells a stand-in from the mesh that took its place."""
    if name == "extremes":
        return extreme_runs.digest()
    if name in ("streams", "ball"):   # of numbers, not of a scene; and made here
        return ""
    return hashlib.sha256(rt.load_scene(name).triangles).hexdigest()


@functools.cache
def _commit() -> str | None:
    try:
        return subprocess.run(["git", "describe", "--always", "--dirty"], text=True, check=True,
                              capture_output=True, cwd=Path(__file__).parent).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
