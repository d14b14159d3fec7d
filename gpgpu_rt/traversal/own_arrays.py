"""Checks that a renderer handles local arrays correctly if fragments use different indices.

Some methods keep a ray's stack in a local array. Mesa's softpipe uses one index for each block of
2 x 2 fragments, and so mixes up the fragments' stacks.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import LimitError
from ..gl.context import Gpu
from ..gl.full_screen import FullScreenPass
from ..gl.textures import make_texture, read_texture
from .method import Method

SIDE, TURNS = 8, 4    # the check draws SIDE x SIDE fragments; each fragment writes TURNS numbers
MIXED_UP = "which this renderer mixes up"


def check_own_arrays(gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
    """Raise LimitError if the renderer mixes up the method's stacks."""
    if method.own_array is None or not method.own_array(options):
        return
    if gpu.keeps_own_arrays is None:
        gpu.keeps_own_arrays = _kept(gpu)
    if not gpu.keeps_own_arrays:
        raise LimitError(f"{method.name} keeps each ray's stack in an array of its fragment, "
                         f"{MIXED_UP} ({gpu.renderer}); use a method without a stack, or another "
                         "renderer")


def _kept(gpu: Gpu) -> bool:
    """Return whether fragments read back the numbers that they wrote."""
    with gpu:
        texture = make_texture(gpu, (SIDE, SIDE), TURNS, "numbers read back from local arrays")
        target = gpu.context.framebuffer([texture])
        try:
            tried = FullScreenPass(gpu, "drivers/own_arrays.frag")
            tried.set(turns=TURNS)
            tried.draw(target, {})
            own = np.arange(SIDE * SIDE).reshape(SIDE, SIDE, 1)
            return bool((read_texture(texture) == own + 1 + np.arange(TURNS)).all())
        finally:
            gpu.release(target)
            texture.release()
