"""Measuring: runs cells and keeps each as a JSON file; figures only read those.

A cell that was finished with the same settings on the same renderer is not measured again.
"""
from __future__ import annotations

import datetime
import functools
import hashlib
import importlib.metadata
import json
import multiprocessing
import signal
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
from gpgpu_rt.bench.engines import CORES, EMBREE, ENGINES, Engine
from gpgpu_rt.bench.workloads import EYE, Workload, load, workload
from gpgpu_rt.files import replacing
from gpgpu_rt.gpu import open_gpu

from . import (
    bundle_errors, caustic_errors, coherence, cpu_peak, extreme_runs, first_hit_times, frame_times,
    gap_work, needs_times, pass_work, path_errors, period_work, reduction_times, refraction_errors,
    tree_sizes, update_times
)

WARM_UPS = 1
COHERENCE = "coherence of "   # then a workload: how alike its rays are
# Approximations of the rasteriser: work -> key of the result, and what measures it.
BESIDE_TRUTH = {"refraction": ("refraction", refraction_errors.measure),
                "caustics": ("caustics", caustic_errors.measure),
                "ray bundles": ("bundles", bundle_errors.measure)}
# Works that time nothing, and may be measured side by side.
UNTIMED = (period_work.WORK, pass_work.PASSES, *gap_work.KINDS, COHERENCE, "tree", "extremes")
ON_CPU = "embreex"   # stands as a method for embreex on threads of the CPU


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
    #                            "caustics": of a scene of `caustic_errors`;
    #                            "ray bundles": of a diffuse scene, or `bundle_errors.HUNG`;
    #                            "first hits": eye rays, rasterised and traced;
    #                            "needs": pictures of a step of `growing`;
    #                            "path errors": by samples up to those of `options`;
    #                            "work of" a workload: what period hardware would do;
    #                            "counted passes of" one: that of a method in many passes;
    #                            "updates": of triangles that moved; embreex has `threads`;
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
    counts = [cell for cell in todo if cell.work.startswith(UNTIMED)]
    with tqdm(total=len(todo), unit="cell", dynamic_ncols=True) as progress:
        for cell in todo:
            if cell in counts and len(counts) > 1:
                continue
            progress.set_description(_words(cell))
            _keep(cell, data)
            progress.update()
        if len(counts) > 1:
            _keep_side_by_side(counts, data, progress)


def _keep_side_by_side(cells: list[Cell], data: Path, progress: Any) -> None:
    """Measure cells in which nothing is timed, one a processor at once, each in a process of its
    own context; interrupting loses those that run."""
    progress.set_description("counting what cards would do")
    # Those of a scene one after another, so that a process makes its tree and its rays once.
    ordered = sorted(cells, key=lambda cell: (cell.scene, cell.size))
    with multiprocessing.get_context("spawn").Pool(
            min(CORES, len(cells)), _ignore_interrupts) as pool:
        for _ in pool.imap_unordered(functools.partial(_keep, data=data), ordered):
            progress.update()


def _ignore_interrupts() -> None:
    """The process that started this one ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _keep(cell: Cell, data: Path) -> None:
    """Measure a cell and write its file, with the seconds that all of it took."""
    began = time.perf_counter()
    result = run(cell)
    result["seconds_spent"] = time.perf_counter() - began
    with replacing(data / cell.name) as path:
        path.write_text(json.dumps(result, indent=1, default=str))


def _words(cell: Cell) -> str:
    return " ".join((cell.scene, cell.method, *(f"{k}={v}" for k, v in cell.options)))


def spent(cells: Iterable[Cell], data: Path) -> float:
    """Seconds that measuring the finished ones of these cells took, all together."""
    found = (read(cell, data) for cell in dict.fromkeys(cells))
    return sum(result.get("seconds_spent", 0.0) for result in found if result is not None)


def run(cell: Cell) -> dict[str, Any]:
    """Measure one cell: warm-ups, timed runs without counters, then counters in a run apart."""
    if cell.work == "extremes":
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": 0,
                "cases": extreme_runs.measure(cell.method, dict(cell.options), cell.size ** 2)}
    if cell.work == "reduction":
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": reduction_times.WARM_UPS,
                "seconds": reduction_times.measure(cell.size ** 2, dict(cell.options)["kept"],
                                                   cell.runs)}
    if cell.work == "path errors":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "errors": path_errors.measure(load(cell.scene), cell.method, dict(cell.options),
                                              cell.size)}
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
    if cell.work.startswith(pass_work.PASSES):
        rays = workload(cell.scene, cell.work.removeprefix(pass_work.PASSES), cell.size)
        return {**_heading(cell, load(cell.scene), open_gpu().info()), "passes": pass_work.measure(
            load(cell.scene), rays, cell.method, dict(cell.options))}
    if cell.work == "updates":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "updates": update_times.measure(load(cell.scene), cell.method,
                                                dict(cell.options), cell.runs)}
    if cell.work == "frames":
        return {**_heading(cell, load(cell.scene), open_gpu().info()),
                "frames": frame_times.measure(cell.scene, cell.method, dict(cell.options),
                                              cell.size, cell.runs)}
    if cell.work in BESIDE_TRUTH:
        key, compare = BESIDE_TRUTH[cell.work]
        return {"settings": settings(cell), "gpu": open_gpu().info(), "commit": commit(),
                "date": datetime.date.today().isoformat(), "warm_ups": WARM_UPS,
                key: compare(cell.scene, cell.method, dict(cell.options), cell.size, cell.runs)}
    if cell.work == "first hits":
        scene = load(cell.scene)
        return {**_heading(cell, scene, open_gpu().info()),
                "first_hits": first_hit_times.measure(scene, cell.method, dict(cell.options),
                                                      cell.size, cell.runs)}
    if cell.method == ON_CPU:
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
        structure = type(tracer.accelerator.structure).__name__
    with rt.Tracer(scene, cell.method, **dict(cell.options), statistics=True) as tracer:
        _trace(rays, tracer)
        driver = tracer.statistics.driver
        # Pixels without a ray count nothing by themselves, and each of a packet what all do.
        width, height = tracer.options.get("packet", (1, 1))
        share = cell.size ** 2 / (max(rays.live, 1) * width * height)
        counters = {name: share * mean for name, mean in tracer.statistics.counters.items()}
    return {**_heading(cell, scene, gpu), **_timing(samples, walls, rays.live),
            "sort_ms": 1e3 * statistics.median(sorts), "statistics": cost, "counters": counters,
            "driver": driver, "structure": structure}


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


def embree(threads: int = 1) -> Engine:
    """Embree among the engines, on so many threads."""
    packages = next(one.packages for one in ENGINES if one.name == EMBREE)
    mine = {one.threads: one for one in reversed(ENGINES) if one.packages == packages}
    if threads not in mine:
        raise rt.Error(f"embreex is measured on {' or '.join(map(str, sorted(mine)))} threads, "
                       f"not on {threads}")
    return mine[threads]


def _run_embree(cell: Cell) -> dict[str, Any]:
    """Eye rays by embreex; what it counts inside is not known."""
    scene, rays = load(cell.scene), workload(cell.scene, cell.work, cell.size)
    threads = dict(cell.options).get("threads", 1)
    engine = embree(threads)
    if engine.missing:
        raise rt.Error(f"{engine.missing} is not installed; run `make setup`")
    run, samples = engine.prepare(scene, rays.compact()), []
    for turn in range(WARM_UPS + cell.runs):
        began = time.perf_counter()
        run()
        if turn >= WARM_UPS:
            samples.append(time.perf_counter() - began)
    return {**_heading(cell, scene, open_gpu().info()), **_timing(samples, samples, rays.live),
            "statistics": {}, "counters": {}, "peak": cpu_peak.peak(threads)}


def _heading(cell: Cell, scene: rt.Scene, gpu: dict[str, Any]) -> dict[str, Any]:
    """What every result begins with: of what, on what, when."""
    return {"settings": settings(cell), "gpu": gpu, "commit": commit(),
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


def picture_size(size: int) -> int:
    """Pixels a side of the picture that is judged beside size squared rays of each kind."""
    return min(256, 2 * size)


@functools.lru_cache(maxsize=1)
def _yardstick(name: str, size: int) -> Yardstick:
    side = picture_size(size)
    return Yardstick(load(name), size ** 2, size=(side, side))


@functools.cache
def _scene_digest(name: str) -> str:
    """Tells a stand-in from the mesh that took its place."""
    if name == "extremes":
        return extreme_runs.digest()
    if name in ("streams", "ball"):   # of numbers, not of a scene; and made here
        return ""
    for made in (caustic_errors, bundle_errors):
        if name in made.MADE:
            return hashlib.sha256(made.scene_of(name).triangles).hexdigest()
    return hashlib.sha256(rt.load_scene(name).triangles).hexdigest()


@functools.cache
def commit() -> str | None:
    """The commit of this package's own tree, or None outside one."""
    try:
        return subprocess.run(["git", "describe", "--always", "--dirty"], text=True, check=True,
                              capture_output=True, cwd=Path(__file__).parent).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
