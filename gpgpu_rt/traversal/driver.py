"""Drivers: what runs a method's programs over the rays; a row names its own by schedule."""
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
from .method import Accelerator, Method
from .packet_hits import PacketHits

Samplers = dict[str, moderngl.Texture]
AnyPass = TypeVar("AnyPass", bound=FragmentPass)
Part = TypeVar("Part")

DONE, UNFINISHED, OVERFLOWN = 0, -1, -2   # phases that end a ray, as in core/phase.glsl
DRAWN = 0.5     # depth of passes over rays; masked rays have depth 0


@dataclass(frozen=True)
class Setup:
    """What a driver is made of.

    Attributes
    ----------
    samplers : sampler name -> texture, the method's tables
    accelerator : uniforms and defines that the method's GLSL asks for
    options : the tracer's and the method's, resolved
    step_cap : steps after which a ray is stopped and flagged
    find_method : name -> row of the method table, for a driver that leaves another method rays
    prepare_other : (method, options) -> samplers and accelerator of another method over the same
        triangles, for a driver that leaves it rays
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
    """Runs a method; made of a ``Setup``."""

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        """Trace every ray; where the hits are, and how many rays were stopped unfinished."""

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""

    def bytes(self) -> int:
        """Bytes of the driver's own textures."""

    def release(self) -> None:
        """Free programs and textures."""


class DriverBase:
    """Programs and targets of a driver: made when first asked for, counted and freed together.

    Parameters
    ----------
    options : the tracer's and the method's, resolved

    Attributes
    ----------
    programs : key -> pass
    kept : name -> target or other part that the driver owns
    keeps_states : whether each ray's state lies in a target of the method's record ``state`` from
        pass to pass, so that it can be observed
    """

    keeps_states = False

    def __init__(self, gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
        self.gpu, self.method, self.options = gpu, method, options
        self.precision = Precision.of(options)
        self.statistics_on = bool(options["statistics"])
        self.programs: dict[Hashable, FragmentPass] = {}
        self.kept: dict[str, Any] = {}

    def uniforms(self) -> Mapping[str, Any]:
        """Uniforms that each program gets when it is made."""
        return {}

    def program(self, key: Hashable, make: Callable[[], AnyPass]) -> AnyPass:
        """The program of a key, compiled by ``make`` when it is first asked for."""
        found: Any = self.programs.get(key)
        if found is None:
            found = self.programs[key] = make()
            found.set(**self.uniforms())
        return found

    def keep(self, name: str, make: Callable[[], Part],
             fits: Callable[[Part], bool] = lambda part: True) -> Part:
        """The part of a name; one that does not fit is released, and ``make`` makes another."""
        part = self.kept.get(name)
        if part is None or not fits(part):
            self.drop(name)
            part = self.kept[name] = make()
        return part

    def drop(self, name: str) -> None:
        """Release the part of a name, if it exists."""
        release(self.kept.pop(name, None))

    def draw(self, program: FullScreenPass, target: Drawable, samplers: Samplers,
             statistics: Statistics, kernel: str | None = None, **more: Any) -> None:
        """Draw one full-screen pass and count it; ``more`` as for ``FullScreenPass.draw``."""
        program.draw(target, samplers, **more)
        self.count_pass(statistics, kernel)

    @staticmethod
    def count_pass(statistics: Statistics, kernel: str | None = None) -> None:
        """Count one pass of one draw, also under a kernel's name where it has one."""
        statistics.passes += 1
        statistics.draw_calls += 1
        if kernel is not None:
            statistics.kernel_passes[kernel] = statistics.kernel_passes.get(kernel, 0) + 1

    def bytes(self) -> int:
        """Bytes of the textures that the driver owns."""
        return bytes_of(self.kept)

    def release(self) -> None:
        """Free programs and parts."""
        release(self.programs, self.kept)
        self.programs, self.kept = {}, {}


class MethodDriver(DriverBase):
    """The base of drivers that are made of a ``Setup``: they follow triangles that move.

    Parameters
    ----------
    driver : for a stage, the driver that it runs on changed rays and owns
    """

    def __init__(self, setup: Setup, driver: Driver | None = None) -> None:
        super().__init__(setup.gpu, setup.method, setup.options)
        self.setup = setup
        self.samplers, self.accelerator = setup.samplers, setup.accelerator
        self.step_cap = setup.step_cap
        if driver is not None:
            self.driver = self.kept["driver"] = driver

    def uniforms(self) -> Mapping[str, Any]:
        """Uniforms of the accelerator, and the step cap."""
        return {**self.accelerator.uniforms, "step_cap": self.step_cap}

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""
        self.samplers, self.accelerator, self.step_cap = samplers, accelerator, step_cap
        for program in self.programs.values():
            program.set(**self.uniforms())

    def state_program(self, file: str, state: Record) -> FullScreenPass:
        """A program of ``glsl/drivers/`` that reads a state and nothing else."""
        record = self.precision.layout(state)
        return self.program((file, record), lambda: FullScreenPass(
            self.gpu, f"drivers/{file}.frag", {}, {"streams": record.stream_glsl(writes=False)}))

    def count_phase(self, phase: int, states: Target, buffers: StateBuffers,
                    statistics: Statistics) -> int:
        """Count the rays whose state is in a phase, by an occlusion query."""
        program = self.state_program("classify", self.method.state)
        program.set(phase=phase)
        self.gpu.context.enable_only(moderngl.NOTHING)
        return program.count(buffers.mask, states.samplers(), statistics, DRAWN)

    def count_stopped(self, final: Target, buffers: StateBuffers, statistics: Statistics) -> int:
        """Count the rays that the step cap stopped."""
        return self.count_phase(UNFINISHED, final, buffers, statistics)
