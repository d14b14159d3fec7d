"""Caustic errors: compares caustics mapping with a map of traced photons."""
from __future__ import annotations

import time
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.render.image_space.caustics import Caustics
from gpgpu_rt.render.image_space.visible import Visible
from gpgpu_rt.scene.procedural.shapes import ball, boxes, floor, noise, turn
from gpgpu_rt.workers.machine import alone

GLASS, WATER = rt.Material("glass", ior=1.5), rt.Material("water", ior=1.33)
SILVER, PAPER = rt.Material("silver", mirror=(0.9, 0.9, 0.9)), rt.Material("paper", (0.7,) * 3)
LIGHT = (2.0, 7.0, 1.0)
SCENES = ("glass ball", "glass bunny", "water", "mirror ring", "ball over steps")
MADE = SCENES
PHOTONS, ITERATIONS = 256, 5


def scene_of(name: str) -> rt.Scene:
    """Return a scene with a refractor or a mirror over a floor or over steps."""
    ground = [floor((-5, -5), (5, 5), 0.0, 4)]
    if name == "glass bunny":
        mesh = rt.load_scene("bunny").triangles.astype(np.float64)
        lo, hi = mesh.min((0, 1)), mesh.max((0, 1))
        part, material = (mesh - (lo + hi) / 2) * (2.4 / (hi - lo).max()) + (0, 1.5, 0), GLASS
    elif name == "water":
        part = floor((-2, -2), (2, 2), 2.0, 64)
        shared = part.reshape(-1, 3)
        part = part + (0, 0.12, 0) * noise(shared * (1, 0, 1), 1.6, 3).reshape(-1, 3, 1)
        material = WATER
    elif name == "mirror ring":
        angle = np.linspace(0, np.pi, 49)
        x, z = -1.5 * np.sin(angle), 1.5 * np.cos(angle)
        a = np.stack([x, 0 * x + 0.01, z], 1)
        b = a + (0, 0.8, 0)
        part = np.concatenate([np.stack([a[:-1], b[:-1], b[1:]], 1),
                               np.stack([a[:-1], b[1:], a[1:]], 1)])
        material = SILVER
    else:
        part, material = ball(8000, (0, 1.4, 0))[:, ::-1], GLASS
    if name == "ball over steps":
        lo = np.array([(-4.0 + k, 0.0, -3.0) for k in range(0, 8, 2)])
        ground.append(turn(boxes(lo, lo + (0.35, 0.3, 6.0)), 0.3, 1))
    triangles = np.concatenate([*ground, part])
    rows = np.zeros(len(triangles), int)
    rows[-len(part):] = 1
    return rt.Scene.from_arrays(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), name=name,
        lights=(), materials=(PAPER, material), material_of=rows, environment=None,
        camera=rt.Camera((-1.5, 4.6, 6.5), (-0.5, 0.4, -0.2), fov=34))


def measure(name: str, method: str, options: dict[str, Any], size: int, runs: int
            ) -> dict[str, Any]:
    """Compare the photons that caustics mapping rasterises with traced photons.

    In the result, ``seconds`` has the times of the mapping and of the tracing; their runs
    alternate. The mapping improves its estimate of a photon's distance to the receiver in steps.
    For each number of steps in ``guesses``, ``apart`` has the median and the 90 % quantile of the
    distance between mapped and traced landing points. ``lost`` is the share of light whose photons
    land if they are traced, but not if they are mapped. ``rasterised`` and ``traced``, (size,
    size), are the camera's pictures of the irradiance on the receivers, without the refractor.
    """
    scene = scene_of(name)
    seconds: dict[str, list[float]] = {"rasterised": [], "traced": []}
    with rt.Tracer(scene, method, **options) as tracer:
        caustics = Caustics(tracer, LIGHT, PHOTONS, 2 * PHOTONS, spread=4.0,
                            iterations=ITERATIONS)
        caustics.map()
        truth = caustics.traced()
        with alone():
            for _ in range(runs):
                began = time.perf_counter()
                caustics.map()
                between = time.perf_counter()
                truth = caustics.traced()
                seconds["rasterised"].append(between - began)
                seconds["traced"].append(time.perf_counter() - between)
        with rt.Tracer(_without(scene, caustics.rows), method, **options) as others:
            seen = Visible.of(others, None, (size, size))
        maps, pictures = [], []
        for landed in (None, truth):
            maps.append(caustics.map(landed).astype(np.float64))
            pictures.append(caustics.look(seen.places, seen.normals))
        guesses, apart, lost = list(range(1, 11)), [], []
        flux = truth[:, :, 3]
        for caustics.iterations in guesses:
            found = caustics.landings()
            both = (found[:, :, 3] > 0) & (flux > 0)
            off = np.linalg.norm(found - truth, axis=2)[both, None]
            apart.append([float(np.quantile(off, q)) for q in (0.5, 0.9)] if both.any() else None)
            lost.append(float(1 - flux[both].sum() / flux.sum()))
        shade = _direct(tracer, seen)
        first = tracer.eye_hits(size=(size, size)).triangle
        hidden = np.isin(first, caustics.rows).reshape(size, size)
        borders = caustics.borders
        caustics.release()
    return {"seconds": seconds, "triangles": len(scene), "borders": borders, "guesses": guesses,
            "apart": apart, "lost": lost, "iterations": ITERATIONS,
            "map_off": float(np.abs(maps[0] - maps[1]).sum() / maps[1].sum()),
            "blurred_off": float(np.abs(_blocks(maps[0] - maps[1])).sum() / maps[1].sum()),
            "brighter": float(maps[0].sum() / maps[1].sum()),
            "rasterised": pictures[0].round(5).tolist(), "traced": pictures[1].round(5).tolist(),
            "shade": shade.round(5).tolist(), "hidden": hidden.tolist()}


def _without(scene: rt.Scene, rows: np.ndarray) -> rt.Scene:
    rest = np.delete(scene.triangles, rows, axis=0)
    return rt.Scene.from_arrays(rest.reshape(-1, 3), np.arange(3 * len(rest)).reshape(-1, 3),
                                camera=scene.camera)


def _direct(tracer: rt.Tracer, seen: Visible) -> np.ndarray:
    """Return (h, w) direct irradiance from the light; 0 where the light is hidden."""
    to = np.asarray(LIGHT) - seen.places
    away = np.linalg.norm(to, axis=2)
    light = np.maximum((to * seen.normals).sum(2), 0) / away ** 3
    start = seen.places + 1e-4 * tracer.scene.extent * seen.normals
    lit = np.flatnonzero(light.reshape(-1))
    hidden = tracer.occluded(start.reshape(-1, 3)[lit], to.reshape(-1, 3)[lit], t_max=0.999)
    light.reshape(-1)[lit[hidden]] = 0
    return light


def _blocks(image: np.ndarray, side: int = 8) -> np.ndarray:
    """Sum an image over squares, so that shifts of light within a square do not count."""
    h, w = (n // side * side for n in image.shape)
    return image[:h, :w].reshape(h // side, side, w // side, side).sum((1, 3))
