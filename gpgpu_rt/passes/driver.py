"""Drivers: what runs a method's programs over the rays; a row names its own by schedule."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Protocol

import moderngl

from ..errors import MethodError
from ..gpu import Gpu
from ..methods.row import Accelerator, Method
from ..ray_state import RayTextures, StateBuffer, StateBuffers
from ..statistics import Statistics
from .own_arrays import check_own_arrays
from .packet_room import PacketHits

Samplers = dict[str, moderngl.Texture]

# What looks on: called after a pass over the rays' (or packets') states with the kernel that ran,
# what it read (None where it set the states up) and what it drew. A driver that keeps states in
# textures from pass to pass has an attribute ``watch`` for one; see ``time_travel.py``.
Watch = Callable[[str, StateBuffer | None, StateBuffer], None]


@dataclass(frozen=True)
class Setup:
    """What a driver is made of.

    Attributes
    ----------
    samplers : sampler name -> texture, the method's tables
    accelerator : uniforms and defines that the method's GLSL asks for
    options : the tracer's and the method's, resolved
    step_cap : steps after which a ray is stopped and flagged
    prepare_other : (method, options) -> samplers and accelerator of another method over the same
        triangles, for a driver that leaves it rays
    """

    gpu: Gpu
    method: Method
    samplers: Samplers
    accelerator: Accelerator
    options: Mapping[str, Any]
    step_cap: int
    prepare_other: Callable[[Method, Mapping[str, Any]], tuple[Samplers, Accelerator]]


class Driver(Protocol):
    """Runs a method; made of a ``Setup``."""

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[StateBuffer | PacketHits, int]:
        """Trace every ray; where the hits are, and how many rays were stopped unfinished."""

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""

    def bytes(self) -> int:
        """Bytes of the driver's own textures."""

    def release(self) -> None:
        """Free programs and textures."""


def make_driver(setup: Setup) -> Driver:
    """The driver that the method's row names for the schedule: ``module.Class`` in this folder;
    from entry points and on sorted rays where options say so."""
    check_own_arrays(setup.gpu, setup.method, setup.options)
    named = setup.method.drivers.get(str(setup.options["schedule"]), "traverse.Traversal")
    driver = driver_class(named)(setup)
    if setup.options.get("entry_points"):
        from .entry_points import EntryPoints
        from .packet_entries import PacketEntries
        driver = (PacketEntries if setup.method.packet else EntryPoints)(setup, driver)
    if setup.options["sort_rays"]:
        from .sorted_rays import SortedRays
        return SortedRays(setup, driver)
    return driver


def driver_class(named: str) -> Callable[[Setup], Driver]:
    """``module.Class`` in this folder.

    Raises
    ------
    MethodError
        where there is none so called
    """
    module, _, name = named.partition(".")
    place = f"{__package__}.{module}"
    there = module.isidentifier() and find_spec(place)
    found = getattr(import_module(place), name, None) if there else None
    if found is None:
        raise MethodError(f"no driver {named!r} in gpgpu_rt/passes; name one as module.Class, as "
                          "traverse.Traversal")
    return found
