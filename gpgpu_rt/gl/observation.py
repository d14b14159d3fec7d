"""Observation: a context calls its observers after each pass.

Passes cost nothing extra without observers. Draws that an observer issues are not observed.
"""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np

if TYPE_CHECKING:
    from .context import Gpu
    from .fragment_pass import FragmentPass
    from .occlusion_query import OcclusionQuery
    from .target import Drawable

Look = Callable[["ObservedPass"], object]


@dataclass(frozen=True, eq=False)
class ObservedPass:
    """One draw of a program.

    Attributes
    ----------
    number : Number of passes that a `Passes` observer received before; 0 for other observers.
    name, vertex : Files of the fragment and the vertex program, below ``glsl/``.
    kernel : Name of the method's kernel that ran. "init" sets up states, "all" runs the kernel
        that each ray's own state names, "visit" and "intersect" run packets. Empty for a
        program without kernels.
    label : The kernel's name if the program runs a single kernel, else ``name``.
    texts : The compiled (vertex, fragment) texts.
    uniforms : Values by name.
    inputs : Textures by sampler name.
    target : The Target that was drawn into, or the framebuffer if it has no Target.
    outputs : The textures that were drawn into.
    program : The linked program.
    draws : Number of draw calls, above 1 if the renderer cannot draw all vertices in one call.
    """

    number: int
    name: str
    vertex: str
    kernel: str
    label: str
    texts: tuple[str, str] = field(repr=False)
    uniforms: dict[str, Any] = field(repr=False)
    inputs: dict[str, moderngl.Texture] = field(repr=False)
    target: Drawable = field(repr=False)
    outputs: tuple[moderngl.Texture, ...] = field(repr=False)
    program: moderngl.Program = field(repr=False)
    draws: int
    covered: Callable[[], np.ndarray | None] = field(repr=False)
    _count: _Count | None = field(repr=False, default=None)

    @property
    def fragments(self) -> int | None:
        """Fragments that passed the depth test and were not discarded; None if not counted."""
        return None if self._count is None else self._count.fragments

    @property
    def primitives(self) -> int | None:
        """Points, lines or triangles that were drawn; None if not counted."""
        return None if self._count is None else self._count.primitives


class Observer:
    """Receives passes. Subclasses override the methods that they need.

    Attributes
    ----------
    counts : whether queries around each draw count fragments and primitives
    states : whether the observer needs each ray's state in textures. The schedule ``loop`` then
        stores its states, which are otherwise in registers
    """

    counts = states = False

    def passed(self, one: ObservedPass) -> None:
        """Receive a drawn pass, whose textures still hold its inputs and outputs."""

    def moved(self, up: int, down: int) -> None:
        """Receive the number of bytes of an upload or a readback."""

    def queried(self) -> None:
        """Receive the start of an occlusion query of the host."""


class Observers:
    """The observers of a context. The object is false without observers, and while an observer
    receives a pass, so that the observer's own draws are not observed."""

    def __init__(self) -> None:
        self.all: list[Observer] = []
        self._telling = False
        self._waiting: list[ObservedPass] | None = None    # passes in a query of the host
        self._free: dict[bool, list[moderngl.Query]] = {True: [], False: []}

    def __bool__(self) -> bool:
        return bool(self.all) and not self._telling

    @property
    def states(self) -> bool:
        return any(observer.states for observer in self.all)

    def draw(self, one: FragmentPass, target: Drawable, framebuffer: moderngl.Framebuffer,
             inputs: Mapping[str, moderngl.Texture], render: Callable[[], int]) -> None:
        """Draw, count fragments if an observer counts, and call the observers."""
        count = None
        if any(observer.counts for observer in self.all):
            within = self._waiting is not None      # GL runs only one occlusion query at a time
            free = self._free[within]
            query = free.pop() if free else framebuffer.ctx.query(samples=not within,
                                                                  primitives=True)
            with query:
                draws = render()
            count = _Count(query, within, free)
        else:
            draws = render()
        one.gpu.fences.keep()       # keep the fence before a read by an observer flushes the draws
        seen = ObservedPass(
            0, one.name, one.vertex, one.kernel, one.label or one.name, one.texts,
            dict(one.uniforms), dict(inputs), target, tuple(framebuffer.color_attachments or ()),
            one.program, draws, lambda: one.covered(target.size), count)
        if self._waiting is None:
            self._tell(seen)
        else:
            self._waiting.append(seen)

    def _tell(self, one: ObservedPass) -> None:
        self._telling = True
        try:
            for observer in list(self.all):
                observer.passed(one)
        finally:
            self._telling = False

    def moved(self, up: int, down: int) -> None:
        """Report the number of bytes of an upload or a readback to the observers."""
        for observer in self.all if self else ():
            observer.moved(up, down)

    def begin_query(self) -> None:
        """Begin an occlusion query of the host. At its end, observers receive its passes."""
        self._waiting = []
        for observer in self.all:
            observer.queried()

    def end_query(self, query: OcclusionQuery) -> None:
        """End an occlusion query of the host. Its count becomes the last pass's fragment count."""
        waiting, self._waiting = self._waiting or [], None
        for at, one in enumerate(waiting):
            if one._count is not None and at == len(waiting) - 1:
                one._count.of_host = query
            self._tell(one)


class HostQuery:
    """An occlusion query of the host while passes are observed.

    OpenGL cannot nest occlusion queries, so an observer cannot count fragments in this query. The
    last pass in the query gets the query's result as its fragment count; earlier passes get 0.
    """

    def __init__(self, observers: Observers, query: OcclusionQuery) -> None:
        self._observers, self._query = observers, query

    def __enter__(self) -> HostQuery:
        self._observers.begin_query()
        self._query.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self._query.__exit__(*exception)
        self._observers.end_query(self._query)

    @property
    def samples(self) -> int:
        """The number of fragments that passed the depth test."""
        return self._query.samples


class _Count:
    """The result of a query, read at the first request. The query is then free for reuse."""

    def __init__(self, query: moderngl.Query, within: bool, free: list[moderngl.Query]) -> None:
        self._query: moderngl.Query | None = query
        # ``within``: the pass is in a query of the host, which counts the fragments instead.
        self._within, self._free = within, free
        self.of_host: OcclusionQuery | None = None
        self._found = 0, 0

    def _read(self) -> tuple[int, int]:
        if self._query is not None:
            counter = self.of_host if self._within else self._query
            self._found = int(counter.samples) if counter else 0, int(self._query.primitives)
            self._free.append(self._query)
            self._query = self.of_host = None
        return self._found

    @property
    def fragments(self) -> int:
        return self._read()[0]

    @property
    def primitives(self) -> int:
        return self._read()[1]


class Passes(list[ObservedPass], Observer):

    def __init__(self, look: Look | None = None, fragments: bool = False) -> None:
        super().__init__()
        self.look, self.counts = look, fragments

    def passed(self, one: ObservedPass) -> None:
        self.append(replace(one, number=len(self)))
        if self.look is not None:
            self.look(self[-1])


@contextmanager
def observe(gpu: Gpu, look: Look | None = None, fragments: bool = False) -> Iterator[Passes]:
    """Observe every pass in the block; see ``Tracer.observe``."""
    passes = Passes(look, fragments)
    with gpu, gpu.observed(passes):
        try:
            yield passes
        finally:
            for one in passes:    # read counts while the context is current
                one.fragments
