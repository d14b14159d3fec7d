"""In the past, a thread that flushes denormal numbers to 0 got wrong hits. The host rounds a t_min
of 1e-45 up to 2^-126. In such a thread, t_min became 0 instead, so a hit at t = 0 was accepted."""
from __future__ import annotations

import ctypes
import platform
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.numerics.denormals import flushed, keeps_denormals

FLUSH = 0x8040      # the bits FTZ and DAZ of MXCSR
MXCSR = 7           # the index of MXCSR in x86-64's fenv_t, in words of 32 bits

pytestmark = pytest.mark.skipif(platform.machine() != "x86_64" or platform.system() != "Linux",
                                reason="the test knows fenv_t of x86-64 Linux only")


@contextmanager
def flushing() -> Iterator[None]:
    library = ctypes.CDLL(None)
    before, state = (ctypes.c_uint32 * 8)(), (ctypes.c_uint32 * 8)()
    library.fegetenv(before)
    library.fegetenv(state)
    state[MXCSR] |= FLUSH
    library.fesetenv(state)
    try:
        yield
    finally:
        library.fesetenv(before)


def test_a_call_keeps_denormals_and_restores_the_state() -> None:
    with flushing():
        assert flushed()
        assert not keeps_denormals(flushed)()
        assert flushed()
    assert not flushed()


def test_the_state_is_restored_after_an_error() -> None:
    @keeps_denormals
    def failing() -> None:
        raise ValueError

    with flushing():
        with pytest.raises(ValueError):
            failing()
        assert flushed()


@pytest.mark.parametrize("method", ("brute-force", "bvh-threaded", "kd-restart"))
def test_hits_at_denormal_t(method: str) -> None:
    """A thread that flushes denormal numbers gives the same hits. The rays start in the triangle's
    plane, so each hit is at t = 0. Most t_min are denormal numbers just below or above 0."""
    scene = rt.Scene.from_arrays([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    origins = np.tile([1.0, 1.0, 0.0], (8, 1))
    directions = np.tile([0.0, 0.0, 1.0], (8, 1))
    smallest = float(np.float32(1e-45))
    t_min = np.array([-smallest, 0, smallest, -1e-40, 1e-40, -1, 0, -1e-39], np.float32)
    with rt.Tracer(scene, method) as tracer:
        expected = tracer.trace(origins, directions, t_min=t_min, t_max=1.0)
        with flushing():
            found = tracer.trace(origins, directions, t_min=t_min, t_max=1.0)
            any_hit = tracer.occluded(origins, directions, t_min=t_min, t_max=1.0)
    assert found.t.tobytes() == expected.t.tobytes()
    assert found.triangle.tolist() == expected.triangle.tolist()
    assert any_hit.tolist() == (expected.triangle >= 0).tolist()
