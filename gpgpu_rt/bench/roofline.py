"""The roofline of the renderer in use: the peak rates of texel fetches and of arithmetic.

The roofline model compares the rate of a program with the peak rates of its machine (Williams,
Waterman and Patterson, "Roofline: an insightful visual performance model for multicore
architectures", CACM 52(4), 2009). Three programs measure the peaks. The first fetches neighbouring
texels from a texture that fits into any cache. The second fetches texels at random from a texture
that fits into no cache. The third computes multiply-adds.
"""
from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import FullScreenPass
from ..gl.textures import make_texture

SIDE = 512            # side of the render target in pixels
TURNS = 64            # iterations of the loop in each program
NEAR, FAR = 5, 11     # log2 of the sides of the textures: 16 KiB, 64 MiB
FLOPS_AN_INSTRUCTION = 2     # a multiply-add is a single instruction
ROUNDS = 8            # rounds per iteration, each with a multiply-add of three vectors of four
FLOPS_A_TURN = ROUNDS * 3 * 4 * FLOPS_AN_INSTRUCTION
RUNS = 5


@dataclass(frozen=True)
class Peaks:
    """Peak rates of a renderer, per second.

    Attributes
    ----------
    near_texels : RGBA32F texels fetched from a texture of 16 KiB, where neighbouring fragments
        fetch neighbouring texels
    far_texels : RGBA32F texels fetched at random from a texture of 64 MiB
    flops : floating point operations; a multiply-add counts as two
    """

    near_texels: float
    far_texels: float
    flops: float

    def to_dict(self) -> dict[str, float]:
        return asdict(self)


def peaks(gpu: Gpu) -> Peaks:
    """Measure the peaks as medians of a few runs; takes less than a second on two cores."""
    with gpu:
        drawn = make_texture(gpu, (SIDE, SIDE), 4, "the roofline's target")
        target = gpu.context.framebuffer([drawn])
        try:
            near, far = (_fetches(gpu, target, side, scattered)
                         for side, scattered in ((NEAR, False), (FAR, True)))
            arithmetic = FullScreenPass(gpu, "bench/peak_arithmetic.frag",
                                        {"TURNS": TURNS, "ROUNDS": ROUNDS})
            return Peaks(near, far, FLOPS_A_TURN * _rate(gpu, arithmetic, target, {}))
        finally:
            gpu.release(target)
            drawn.release()


def _fetches(gpu: Gpu, target: moderngl.Framebuffer, side: int, scattered: bool) -> float:
    texels = make_texture(gpu, (1 << side, 1 << side), 4, "the roofline's texels",
                          np.ones((1 << side, 1 << side, 4), np.float32))
    fetch = FullScreenPass(gpu, "bench/peak_fetch.frag",
                           {"TURNS": TURNS, "SIDE_LOG2": side, "SCATTERED": scattered})
    try:
        return _rate(gpu, fetch, target, {"texels_table": texels})
    finally:
        texels.release()


def _rate(gpu: Gpu, program: FullScreenPass, target: moderngl.Framebuffer,
          textures: Mapping[str, moderngl.Texture]) -> float:
    """Return how many iterations of the program's loop run per second, over all fragments."""
    times = []
    for _ in range(RUNS + 1):    # the first run is the warm-up
        gpu.finish()
        began = time.perf_counter()
        program.draw(target, textures)
        gpu.finish()
        times.append(time.perf_counter() - began)
    program.release()
    return SIDE * SIDE * TURNS / statistics.median(times[1:])
