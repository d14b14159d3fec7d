"""Bundle errors: compares ray bundles with traced bundles and with the path tracer.

A ray bundle is a set of parallel rays, rasterised as a parallel projection of the scene. In a
traced bundle, each ray is traced.
"""
from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.render.image_space.patches import LIFT, areas_and_normals
from gpgpu_rt.render.image_space.ray_bundles import RayBundles, half_sphere
from gpgpu_rt.render.image_space.visible import Visible
from gpgpu_rt.scene.procedural import cornell
from gpgpu_rt.workers.machine import alone

HUNG = "cornell, lamp hung"
MADE = (HUNG,)
LAMP = 1        # the lamp's row among the box's materials
BOUNCES = 7
FINER = 2       # light is gathered at FINER x FINER places in a pixel


def scene_of(name: str) -> rt.Scene:
    """Return the scene of this name.

    HUNG is `cornell-light`, but its lamp hangs half a millimetre under a closed ceiling, as the
    lamp of `cornell` does.
    """
    if name != HUNG:
        return rt.load_scene(name)
    light, box = rt.load_scene("cornell-light"), cornell.make()
    assert light.material_of is not None
    lamps = np.count_nonzero(light.material_of == LAMP)   # the lamp has the last triangles
    row = np.zeros(len(box.triangles), np.int32)
    row[-lamps:] = LAMP
    return replace(light, name=name, faces=None, material_of=row,
                   triangles=np.asarray(box.triangles, np.float32),
                   colours=np.asarray(box.colours, np.float32))


def traced_gather(bundles: RayBundles, cut: rt.Tracer, seen: Visible, count: int
                  ) -> tuple[np.ndarray, float]:
    """Gather light like ``bundles.gather``, but trace the rays with ``cut``, a tracer of patches.

    Returns (h, w, 3) irradiance, and the seconds of tracing.
    """
    normals = seen.normals.reshape(-1, 3)
    start = seen.places.reshape(-1, 3) + np.float32(LIFT * bundles.scene.extent) * normals
    _, flat = areas_and_normals(bundles.triangles)
    sums, weights, seconds = np.zeros((len(start), 3)), np.zeros((len(start), 1)), 0.0
    for along in half_sphere(count):
        facing = (normals * along).sum(1)
        ways = np.where(facing[:, None] > 0, along, -along)
        hits = cut.trace(start, ways, shape=seen.places.shape[:2])
        seconds += cut.statistics.trace_seconds
        side = ((flat[hits.triangle] * ways).sum(1) > 0).astype(int)
        light = bundles.leaving[hits.triangle, side] * hits.hit[:, None]
        sums += light * np.abs(facing)[:, None]
        weights += np.abs(facing)[:, None]
    return (np.pi * sums / np.maximum(weights, 1e-30)).reshape(seen.places.shape), seconds


def measure(name: str, method: str, options: dict[str, Any], size: int, runs: int
            ) -> dict[str, Any]:
    """Return pictures of a scene, (size, size, 3), with their errors and times.

    Parameters
    ----------
    options : the settings of the bundles: ``patch``, the longest edge of a patch as a share of the
        scene's extent; ``directions``, the number of directions for gathering; ``between``, the
        number of directions along which patches exchange light; and ``resolutions``, in pixels per
        side of a projection. ``samples`` is the path tracer's number of samples per pixel. All
        other options belong to the tracer
    """
    mine = {word: options.pop(word) for word in ("patch", "directions", "between", "resolutions",
                                                 "samples")}
    scene = scene_of(name)
    result: dict[str, Any] = {"triangles": len(scene), "by_resolution": []}
    with rt.Tracer(scene, method, **options) as tracer:
        with alone():
            began, halves = time.perf_counter(), []
            for seed in (0, 1):
                tracer.render(size=(size, size), integrator="path", samples=mine["samples"] // 2,
                              seed=seed)
                halves.append(tracer.radiance.astype(np.float64))
            result["path_seconds"] = time.perf_counter() - began
        path = sum(halves) / 2
        seen = Visible.of(tracer, None, (FINER * size, FINER * size))
        for resolution in mine["resolutions"]:
            bundles = RayBundles(tracer, mine["patch"], resolution)
            with alone():
                began = time.perf_counter()
                bundles.solve(mine["between"], BOUNCES)
                took = time.perf_counter() - began
            row = {"resolution": resolution, "solve_seconds": took,
                   "patches": len(bundles.triangles), "layers": bundles.layers,
                   "unmet": float((bundles.weights == 0).mean()), "gather": [], "traced": []}
            faces = np.arange(3 * len(bundles.triangles)).reshape(-1, 3)
            cut = rt.Tracer(rt.Scene.from_arrays(bundles.triangles.reshape(-1, 3), faces), method,
                            **options)
            found = bundles.gather(seen.places, seen.normals, mine["directions"])
            right, _ = traced_gather(bundles, cut, seen, mine["directions"])
            with alone():
                for _ in range(runs):
                    began = time.perf_counter()
                    bundles.gather(seen.places, seen.normals, mine["directions"])
                    row["gather"].append(time.perf_counter() - began)
                    row["traced"].append(traced_gather(bundles, cut, seen, mine["directions"])[1])
            row["off"] = float(np.sqrt(((found - right) ** 2).mean() / (right ** 2).mean()))
            apart = np.abs(found - right).max(2) > 0.05 * right.mean()
            row["apart"] = float(apart[seen.hits.hit.reshape(apart.shape)].mean())
            picture = bundles.draw(size=(FINER * size, FINER * size),
                                   directions=mine["directions"])
            row["picture"] = _smaller(picture, size)
            result["by_resolution"].append(row)
            bundles.release()
            cut.release()
        out = left_out(scene, seen, size)
    for row in result["by_resolution"]:
        row.update(_errors(row["picture"], path, out))
        row["picture"] = row["picture"].round(4).tolist()
    # ``path`` is the mean of two pictures, each from half of the samples. Half of the difference
    # of these pictures estimates the noise of the mean.
    noise = _errors(halves[0], path, out)["rmse"]
    return {**result, **mine, "path_noise": noise, "path": path.round(4).tolist(),
            "out": out.tolist()}


def left_out(scene: rt.Scene, seen: Visible, size: int) -> np.ndarray:
    """Return the pixels that the comparison leaves out, (size, size) bool.

    These are the pixels of lamps, of the background and of edges, and all neighbours of these
    pixels. There the light changes within a pixel: the path tracer averages over the pixel, but
    bundles gather at only a few places.
    """
    emits = np.array([m.emits for m in scene.materials])[scene.material_of]
    rest = (emits[seen.hits.triangle] | ~seen.hits.hit).reshape(FINER * size, -1, 1)
    height = (seen.normals * seen.places).sum(2, keepdims=True) / scene.extent
    planes = np.concatenate([seen.normals, height], axis=2, dtype=np.float64)
    for axis in (0, 1):
        jump = (np.abs(np.diff(planes, axis=axis)) > 1e-3).any(axis=2, keepdims=True)
        before, behind = (np.pad(jump, [side if k == axis else (0, 0) for k in range(3)])
                          for side in ((0, 1), (1, 0)))
        rest |= before | behind
    return _near(_smaller(rest.astype(float), size)[:, :, 0] > 0)


def _errors(picture: np.ndarray, path: np.ndarray, out: np.ndarray) -> dict[str, float]:
    """Return a picture's errors against the path tracer's picture, without the pixels ``out``."""
    off = (picture - path)[~out]
    truth = path[~out]
    return {"rmse": float(np.sqrt((off ** 2).mean()) / truth.mean()),
            "bias": float(off.mean() / truth.mean()),
            "median": float(np.median(np.abs(off).sum(1) / np.maximum(truth.sum(1), 1e-6)))}


def _smaller(picture: np.ndarray, size: int) -> np.ndarray:
    return picture.reshape(size, FINER, size, FINER, -1).mean((1, 3))


def _near(some: np.ndarray) -> np.ndarray:
    """Return the pixels that are set in ``some``, and their neighbours, (h, w) bool."""
    wide = np.pad(some, 1)
    h, w = some.shape
    return np.any([wide[y:y + h, x:x + w] for y in range(3) for x in range(3)], axis=0)
