"""The roofline of the present renderer: how fast fragment programs fetch texels and calculate.

Williams, Waterman and Patterson, "Roofline: an insightful visual performance model for multicore
architectures", CACM 52(4), 2009: what a program reaches is held against what it could reach.
Three programs that do nothing else measure the peaks: fetches that neighbouring pixels share, from
a texture that fits any cache; fetches all over a texture that fits none; and multiply-adds.
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

SIDE = 512            # pixels
TURNS = 64            # of each program's loop
NEAR, FAR = 5, 11     # log2 of the textures' sides: 16 KiB, 64 MiB
FLOPS_AN_INSTRUCTION = 2     # of a multiply-add
ROUNDS = 8            # of multiply-adds a turn, each of three vectors of four
FLOPS_A_TURN = ROUNDS * 3 * 4 * FLOPS_AN_INSTRUCTION
RUNS = 5


@dataclass(frozen=True)
class Peaks:
    """Rates of a renderer, a second.

    Attributes
    ----------
    near_texels : RGBA32F texels fetched from a texture of 16 KiB, neighbours side by side
    far_texels : the same from 64 MiB, each fragment somewhere else
    flops : floating point operations, a multiply-add counting two
    """

    near_texels: float
    far_texels: float
    flops: float

    def to_dict(self) -> dict[str, float]:
        return asdict(self)


def peaks(gpu: Gpu) -> Peaks:
    """Measure them: medians of a few runs, under a second on two cores."""
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
    """Turns of the program's loop a second."""
    times = []
    for _ in range(RUNS + 1):    # the first one warms up
        gpu.finish()
        began = time.perf_counter()
        program.draw(target, textures)
        gpu.finish()
        times.append(time.perf_counter() - began)
    program.release()
    return SIDE * SIDE * TURNS / statistics.median(times[1:])
