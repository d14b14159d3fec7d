"""Denormals: a decorator that makes the host's arithmetic keep denormal numbers.

A library in the same process may make the processor flush denormal numbers to 0. An interval's end
or a hit's t may be denormal, so flushing could lose a hit.
"""
from __future__ import annotations

import ctypes
import functools
import sys
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numpy as np

Given = ParamSpec("Given")
Made = TypeVar("Made")

_SMALLEST, _ONE = np.float32(1e-45), np.float32(1)
_STATE_BYTES = 64       # at least the size of C's fenv_t: 32 on x86-64, 8 on AArch64


def flushed() -> bool:
    """Return whether arithmetic of this thread flushes denormal numbers to 0."""
    return bool(_SMALLEST * _ONE == 0)


def keeps_denormals(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Decorate a public function: denormal numbers are kept during a call.

    If the thread flushes denormal numbers, the call runs in C's default floating-point state, and
    the thread's own state is restored afterwards. On Windows, denormal numbers are still flushed.
    """
    @functools.wraps(function)
    def kept(*given: Given.args, **named: Given.kwargs) -> Made:
        if not flushed() or sys.platform == "win32":
            return function(*given, **named)
        library = ctypes.CDLL(None)
        before = ctypes.create_string_buffer(_STATE_BYTES)
        library.fegetenv(before)
        library.fesetenv(_default_state(library))
        try:
            return function(*given, **named)
        finally:
            library.fesetenv(before)
    return kept


def _default_state(library: ctypes.CDLL) -> object:
    """Return FE_DFL_ENV of C's <fenv.h>: the pointer -1 in most C libraries."""
    if sys.platform == "darwin":
        return ctypes.byref(ctypes.c_char.in_dll(library, "_FE_DFL_ENV"))
    return ctypes.c_void_p(-1)
