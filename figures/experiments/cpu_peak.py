"""CPU peak: finds the processor's nominal arithmetic rate, and the rates of programs."""
from __future__ import annotations

import functools
import re
import statistics
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.environment import processors
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.textures import make_texture

# Flag of a processor -> single precision operations per core and clock. The first entry with a
# flag of the processor decides. A core is assumed to have two vector units. With fused
# instructions, both units multiply and add; without them, one unit multiplies and the other adds.
A_CLOCK = (("avx512f", 64), ("fma", 32), ("avx", 16), ("sse2", 8))
BASE = Path("/sys/devices/system/cpu/cpu0/cpufreq/base_frequency")   # kHz
MATRIX = 768   # rows of the matrices whose product is timed
SIDE = 512     # side in pixels of the render target of the timed fragment program
TURNS, ROUNDS = 64, 8             # iterations of the fragment program's two nested loops
FLOPS_A_FRAGMENT = TURNS * ROUNDS * 3 * 4 * 2     # 3 multiply-adds of vec4 per iteration
RUNS = 5       # timed runs of the fragment program, after a warm-up run


@functools.cache
def peak(count: int) -> dict[str, Any]:
    """Return arithmetic rates of the processor, in FLOP/s of single precision.

    Only the nominal rate depends on ``count``, the number of threads.

    Returns
    -------
    nominal : the product clock * a_clock * cores, or None if a factor is unknown.
    attained : the rate of numpy's matrix product on numpy's threads; the fastest of several runs.
    fragments : the rate of multiply-adds in fragment programs of the current renderer.
    clock : in Hz.
    a_clock : operations per core and clock.
    cores : the smaller of ``count`` and the number of physical cores.
    model, threads : the processor's model, and ``count``.
    clock_is : words that say whether ``clock`` is the base clock or the current clock.
    """
    listed = processors()
    facts = listed[0] if listed else {}
    flags = facts.get("flags", "").split()
    a_clock = next((n for flag, n in A_CLOCK if flag in flags), None)
    clock, clock_is = clock_of(facts, BASE)
    cores = min(count, cores_of(listed) or count)
    return {"nominal": clock * a_clock * cores if clock and a_clock else None,
            "attained": _attained(), "fragments": _of_fragments(),
            "model": facts.get("model name"), "clock": clock, "clock_is": clock_is,
            "a_clock": a_clock, "cores": cores, "threads": count}


def clock_of(facts: Mapping[str, str], base: Path) -> tuple[float | None, str]:
    """Return the clock in Hz, and words that say which clock it is.

    The base clock comes from the file ``base`` or the model's name. If neither has it, the clock
    is the current clock, or None if unknown.
    """
    try:
        return 1e3 * float(base.read_text()), "the base clock, as cpufreq says"
    except (OSError, ValueError):
        pass
    named = re.search(r"([0-9.]+) *GHz", facts.get("model name", ""))
    if named:
        return 1e9 * float(named[1]), "the base clock, as the model's name says"
    if "cpu MHz" in facts:
        return 1e6 * float(facts["cpu MHz"]), "the clock when this was measured, no base is known"
    return None, "not known"


def cores_of(listed: Sequence[Mapping[str, str]]) -> int:
    """Return the number of physical cores, or 0 if unknown. A core's threads have the same ids."""
    return len({(one["physical id"], one["core id"]) for one in listed
                if "physical id" in one and "core id" in one})


@functools.cache
def _of_fragments() -> float:
    gpu, times = open_gpu(), []
    with gpu:
        drawn = make_texture(gpu, (SIDE, SIDE), 4, "the multiply-adds' target")
        target = gpu.context.framebuffer([drawn])
        program = FullScreenPass(gpu, "bench/peak_arithmetic.frag",
                                 {"TURNS": TURNS, "ROUNDS": ROUNDS})
        for _ in range(RUNS + 1):
            gpu.finish()
            began = time.perf_counter()
            program.draw(target, {})
            gpu.finish()
            times.append(time.perf_counter() - began)
        program.release()
        gpu.release(target)
        drawn.release()
    return SIDE * SIDE * FLOPS_A_FRAGMENT / statistics.median(times[1:])


@functools.cache
def _attained() -> float:
    one = np.random.default_rng(0).random((MATRIX, MATRIX), np.float32)
    times = []
    for _ in range(6):
        began = time.perf_counter()
        one @ one
        times.append(time.perf_counter() - began)
    return 2.0 * MATRIX ** 3 / min(times)
