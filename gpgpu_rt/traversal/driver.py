"""Drivers: a driver runs a method's programs over the rays.

A row of the method table may name a driver for a schedule; see `assembly.make_driver`.
"""
from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import moderngl

from ..gl.context import Gpu
from ..gl.fragment_pass import FragmentPass
from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.target import Drawable, Target
from ..gl.textures import bytes_of, release
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .accelerator import Accelerator
from .method import Method
from .packet_hits import PacketHits

Samplers = dict[str, moderngl.Texture]
AnyPass = TypeVar("AnyPass", bound=FragmentPass)
Part = TypeVar("Part")

DONE, UNFINISHED, OVERFLOWN = 0, -1, -2   # phases of ended rays, as in core/phase.glsl
QUERY_INTERVAL = 16     # steps between two counts of the live rays, if the user gives no interval
DRAWN = 0.5     # depth of passes over rays; a masked ray has depth 0 and so fails the depth test


@dataclass(frozen=True)
class Setup:
    """The parts from which a driver is made.

    Attributes
    ----------
    samplers : sampler name -> texture of the method's tables
    accelerator : uniforms and defines that the method's GLSL needs
    options : the options of the tracer and of the method, resolved
    step_cap : steps after which a ray is stopped and flagged
    find_method : name -> row of the method table, to hand rays to another method
    prepare_other : (method, options) -> samplers and accelerator of that method over the same
        triangles
    """

    gpu: Gpu
    method: Method
    samplers: Samplers
    accelerator: Accelerator
    options: Mapping[str, Any]
    step_cap: int
    find_method: Callable[[str], Method]
    prepare_other: Callable[[Method, Mapping[str, Any]], tuple[Samplers, Accelerator]]


class Driver(Protocol):
    """Runs a method's programs over rays."""

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        """Trace every ray. Return the hits and the number of rays that were stopped early."""

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Use new tables after the triangles moved. Records and defines are unchanged."""

    def bytes(self) -> int:
        """Return the bytes of the driver's own textures."""

    def release(self) -> None:
        """Free programs and textures."""


class DriverBase:
    """The programs and targets of a driver, made at first use and freed together.

    Parameters
    ----------
    options : the options of the tracer and of the method, resolved

    Attributes
    ----------
    programs : key -> pass
    kept : name -> target or other part that the driver owns
    keeps_states : whether a target keeps each ray's state between passes, for observers
    """

    keeps_states = False

    def __init__(self, gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
        self.gpu, self.method, self.options = gpu, method, options
        self.precision = Precision.of(options)
        self.statistics_on = bool(options["statistics"])
        self.programs: dict[Hashable, FragmentPass] = {}
        self.kept: dict[str, Any] = {}

    @property
    def mask_interval(self) -> int:
        """Number of passes (in `PacketSteps`, of steps) between two counts of the live rays."""
        steps = self.options["steps_per_pass"] if self.options["schedule"] == "step" else 1
        return self.options["mask_interval"] or max(2, QUERY_INTERVAL // steps)

    def uniforms(self) -> Mapping[str, Any]:
        """Return the uniforms that each new program gets."""
        return {}

    def program(self, key: Hashable, make: Callable[[], AnyPass]) -> AnyPass:
        """Return the program of a key, made at the first request."""
        found: Any = self.programs.get(key)
        if found is None:
            found = self.programs[key] = make()
            found.set(**self.uniforms())
        return found

    def keep(self, name: str, make: Callable[[], Part],
             fits: Callable[[Part], bool] = lambda part: True) -> Part:
        """Return the part ``name``, made anew if it is missing or does not fit."""
        part = self.kept.get(name)
        if part is None or not fits(part):
            self.drop(name)
            part = self.kept[name] = make()
        return part

    def drop(self, name: str) -> None:
        release(self.kept.pop(name, None))

    def draw(self, program: FullScreenPass, target: Drawable, samplers: Samplers,
             statistics: Statistics, kernel: str | None = None, **more: Any) -> None:
        """Draw and count a full-screen pass. ``more`` goes to ``FullScreenPass.draw``."""
        program.draw(target, samplers, **more)
        self.count_pass(statistics, kernel)

    @staticmethod
    def count_pass(statistics: Statistics, kernel: str | None = None) -> None:
        """Count a pass of a single draw call; with ``kernel``, also as a pass of this kernel."""
        statistics.passes += 1
        statistics.draw_calls += 1
        if kernel is not None:
            statistics.kernel_passes[kernel] = statistics.kernel_passes.get(kernel, 0) + 1

    def bytes(self) -> int:
        return bytes_of(self.kept)

    def release(self) -> None:
        release(self.programs, self.kept)
        self.programs, self.kept = {}, {}


class MethodDriver(DriverBase):
    """The base class of drivers that are made from a ``Setup`` and can follow moving triangles.

    Parameters
    ----------
    driver : the inner driver, if this driver is a stage (such as `SortedRays`), else None. A stage
        prepares the rays or their entry nodes, and then runs the inner driver
    """

    def __init__(self, setup: Setup, driver: Driver | None = None) -> None:
        super().__init__(setup.gpu, setup.method, setup.options)
        self.setup = setup
        self.samplers, self.accelerator = setup.samplers, setup.accelerator
        self.step_cap = setup.step_cap
        if driver is not None:
            self.driver = self.kept["driver"] = driver

    def uniforms(self) -> Mapping[str, Any]:
        return {**self.accelerator.uniforms, "step_cap": self.step_cap}

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        self.samplers, self.accelerator, self.step_cap = samplers, accelerator, step_cap
        for program in self.programs.values():
            program.set(**self.uniforms())

    def state_program(self, file: str, state: Record) -> FullScreenPass:
        record = self.precision.layout(state)
        return self.program((file, record), lambda: FullScreenPass(
            self.gpu, f"drivers/{file}.frag", {}, {"streams": record.stream_glsl(writes=False)}))

    def count_phase(self, phase: int, states: Target, buffers: StateBuffers,
                    statistics: Statistics) -> int:
        """Return the number of rays in a phase. UNFINISHED stands for every stopped ray."""
        program = self.state_program("classify", self.method.state)
        program.set(phase=phase)
        self.gpu.context.enable_only(moderngl.NOTHING)
        return program.count(buffers.mask, states.samplers(), statistics, DRAWN)

    def count_stopped(self, final: Target, buffers: StateBuffers, statistics: Statistics) -> int:
        return self.count_phase(UNFINISHED, final, buffers, statistics)
