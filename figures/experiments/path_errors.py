"""Path errors: measures the errors of path traced pictures, by number of samples.

A furnace (a closed box whose walls emit and reflect evenly) is compared with a formula. The
Cornell box is compared with an independent renderer (measured/README.md).
"""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import gpgpu_rt as rt

TRUTH = Path(__file__).parents[1] / "measured" / "cornell-light-64.npz"
FEWEST = 64      # the smallest number of samples that is measured
EMITTED, REFLECTED = np.array((0.5, 0.4, 0.3)), 0.6


def furnace() -> tuple[rt.Scene, np.ndarray]:
    """The furnace and the radiance inside it."""
    box = trimesh.creation.box((2, 2, 2))
    walls = rt.Material(diffuse=(REFLECTED,) * 3, emission=tuple(EMITTED))
    return rt.Scene.from_arrays(
        box.vertices, box.faces, materials=(walls,), lights=(), environment=None,
        camera=rt.Camera((0.1, 0.2, 0.3), (0.9, 0.1, 0.2), fov=90)), EMITTED / (1 - REFLECTED)


def cornell_truth() -> tuple[np.ndarray, np.ndarray]:
    """Return Mitsuba 3's picture of ``cornell-light`` and its standard error.

    Both are (64, 64, 3) float64, linear.
    """
    with np.load(TRUTH) as kept:
        return kept["radiance"].astype(np.float64), kept["error"].astype(np.float64)


def truth_noise() -> float:
    """Return the mean relative error of Mitsuba's picture, assuming normally distributed noise."""
    radiance, error = cornell_truth()
    seen = radiance > 0
    return float(np.sqrt(2 / np.pi) * (error[seen] / radiance[seen]).mean())


def relative_error(found: np.ndarray, truth: np.ndarray) -> float:
    """The mean relative error over all channels that are not black in the truth."""
    seen = truth > 0
    return float((np.abs(found - truth)[seen] / truth[seen]).mean())


def measure(scene: rt.Scene, method: str, options: dict[str, Any], size: int) -> dict[str, Any]:
    """Return three mean relative errors for each number of samples, and ``truth_noise``.

    `scene` is the error of the scene's pixels without the noise of Mitsuba's picture:
    sqrt(error^2 - ``truth_noise``^2). `furnace` is the error of the furnace's pixels, and
    `furnace_mean` is the error of the mean of these pixels.

    Parameters
    ----------
    options : "samples", the largest number of samples, and other options of the integrator
    """
    furnace_scene, expected = furnace()
    truth, noise = cornell_truth()[0], truth_noise()
    found: dict[str, dict[int, float]] = {"scene": {}, "furnace": {}, "furnace_mean": {}}
    for samples, light in pictures(scene, method, options, size):
        whole = relative_error(light, truth)
        found["scene"][samples] = float(np.sqrt(max(whole ** 2 - noise ** 2, 0)))
    for samples, light in pictures(furnace_scene, method, options, 16):
        found["furnace"][samples] = relative_error(light, np.broadcast_to(expected, light.shape))
        found["furnace_mean"][samples] = relative_error(light.mean(axis=(0, 1)), expected)
    return {**found, "truth_noise": noise}


def pictures(scene: rt.Scene, method: str, options: dict[str, Any], size: int
             ) -> Iterator[tuple[int, np.ndarray]]:
    """Yield (samples, radiance) for powers of two; the radiance is (size, size, 3)."""
    with rt.Tracer(scene, method) as tracer:
        for power in range(FEWEST.bit_length() - 1, int(options["samples"]).bit_length()):
            tracer.render(size=(size, size), integrator="path",
                          **{**options, "samples": 1 << power})
            yield 1 << power, tracer.radiance.astype(np.float64)
