"""Accelerator: the structure over a scene's triangles, as a method's programs read it."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.lazy_field import Column


class Finisher(Protocol):
    """Runs passes that complete tables on the GPU."""

    def run(self, gpu: Gpu, samplers: Mapping[str, moderngl.Texture]) -> None:
        """Complete the tables after a write. ``samplers`` maps sampler names to textures."""

    def release(self) -> None:
        """Free the programs and textures of the passes."""


@dataclass
class Accelerator:
    """The tables, uniforms and defines that a method's programs read.

    Attributes
    ----------
    tables : Record name -> field name -> array (or Column). The fields are packed into textures.
    uniforms : Uniform name -> value.
    step_bound : Upper bound on the kernel runs of a ray.
    structure : The builder's result, of any type, or None.
    defines : GLSL defines that follow from the structure.
    stack_levels : Largest number of levels in the stack of a ray or packet.
    finisher : Passes that complete the tables after their upload.
    shown : The triangles on which hits lie, (n, 3, 3) float32, if the method traces a coarser
        level of the scene; otherwise None.
    kept : Data that the builder keeps for ``Method.refit``.
    boxes : Returns the lower and the upper corners, (k, 3) each, of the nodes' boxes, indexed by
        the state's field ``node``. `Tracer.updates` sends accelerators between processes, so use
        a method or `functools.partial`, which can be pickled, instead of a lambda.
    automatic : Option -> the value that the builder uses, for options that are None.
    pointers : Names of uniforms that are pointers to a table's elements, given as indices.
    numbered : Number of elements, such as leaves, that a program numbers in one float even if
        pointers are columns and rows (``glsl/core/pointer.glsl``). Do not include triangles.
    small_integers : Whether all integers in tables are at most 2^22 (``glsl/core/fetch.glsl``).
        `session.structure.Structure` sets this field when it writes the tables into textures.
    """

    tables: dict[str, dict[str, np.ndarray | Column]]
    uniforms: dict[str, Any]
    step_bound: int
    structure: Any = None
    defines: Mapping[str, object] = field(default_factory=dict)
    stack_levels: int = 0
    finisher: Finisher | None = None
    shown: np.ndarray | None = None
    kept: Any = None
    boxes: Callable[[], tuple[np.ndarray, np.ndarray]] | None = None
    automatic: Mapping[str, Any] = field(default_factory=dict)
    pointers: tuple[str, ...] = ()
    numbered: int = 0
    small_integers: bool = False
