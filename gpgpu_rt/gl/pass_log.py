"""The log of a call's passes: what was drawn, how many fragments ran, what was read and written.

``Tracer`` keeps one with ``statistics=True``. Fragments are counted by an occlusion query around
each draw, so early depth and the rectangles drawn count as they work; of a program that discards,
those it keeps. Without a log nothing is counted and nothing costs.
"""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any

import moderngl

from ..statistics import Statistics
from .context import Gpu

AT_ONCE = 64    # queries that wait to be read


@dataclass
class PassWork:
    """All draws of one program under one name.

    Attributes
    ----------
    name : the kernel it runs, or the program
    texts : what it was compiled from, (vertex, fragment)
    draws, fragments : how many
    streams_read : bytes of streams that fragments read: each texel once
    tables : the tables it samples; how often is the program's to say (see ``gpgpu_rt.hardware``)
    texel_bytes : sampler -> bytes of a texel of what it reads
    written : bytes written to render targets
    """

    name: str
    texts: tuple[str, str]
    draws: int = 0
    fragments: int = 0
    streams_read: int = 0
    tables: tuple[str, ...] = ()
    texel_bytes: dict[str, int] = field(default_factory=dict)
    written: int = 0
    read_each: int = field(default=0, repr=False)
    written_each: int = field(default=0, repr=False)


@dataclass
class PassLog:
    """The passes of a call, and what went between host and card."""

    passes: dict[tuple[str, int], PassWork] = field(default_factory=dict)
    queries: int = 0
    uploaded: int = 0
    read_back: int = 0
    _waiting: list[tuple[PassWork, moderngl.Query]] = field(default_factory=list)
    _free: list[moderngl.Query] = field(default_factory=list)
    _last: PassWork | None = None
    _in_query: bool = False

    @contextmanager
    def drawing(self, name: str, program: moderngl.Program, texts: tuple[str, str],
                target: moderngl.Framebuffer,
                textures: Mapping[str, moderngl.Texture]) -> Iterator[None]:
        """Around a draw of ``program``, which samples ``textures``, into ``target``."""
        one = self.passes.get((name, id(program)))
        if one is None:
            one = self.passes[name, id(program)] = PassWork(name, texts)
            one.tables = tuple(sorted(n for n in textures if n.endswith("_table")))
            one.texel_bytes = {name: _texel_bytes(t) for name, t in textures.items()}
        one.read_each = sum(_texel_bytes(t) for n, t in textures.items()
                            if not n.endswith("_table"))
        one.written_each = sum(map(_texel_bytes, target.color_attachments or ()))
        one.draws += 1
        self._last = one
        if self._in_query:       # the host counts this one itself
            yield
            return
        query = self._free.pop() if self._free else target.ctx.query(samples=True)
        with query:
            yield
        self._waiting.append((one, query))
        if len(self._waiting) >= AT_ONCE:
            self._read()

    def hosts(self, query: moderngl.Query) -> HostQuery:
        """A query of the host's own, as it is to be used."""
        return HostQuery(self, query)

    def _take(self, one: PassWork, fragments: int) -> None:
        one.fragments += fragments
        one.streams_read += fragments * one.read_each
        one.written += fragments * one.written_each

    def _read(self) -> None:
        for one, query in self._waiting:
            self._take(one, query.samples)
            self._free.append(query)
        self._waiting = []

    def to_list(self) -> list[dict[str, Any]]:
        """Every program's work as plain data, in the order of their first draws."""
        self._read()
        left_out = ("texts", "read_each", "written_each")
        return [{key: value for key, value in asdict(one).items() if key not in left_out}
                for one in self.passes.values()]


@contextmanager
def logged(gpu: Gpu, statistics: Statistics) -> Iterator[PassLog]:
    """Within, passes are logged; the statistics then hold what they were."""
    gpu.log = log = PassLog()
    try:
        yield log
    finally:
        gpu.log = None
    statistics.pass_log = log.to_list()
    statistics.uploaded_bytes, statistics.read_back_bytes = log.uploaded, log.read_back


class HostQuery:
    """An occlusion query of the host, whose count is its draw's count too."""

    def __init__(self, log: PassLog, query: moderngl.Query) -> None:
        self._log, self._query = log, query
        self._counted: PassWork | None = None

    def __enter__(self) -> HostQuery:
        self._log._in_query, self._log._last = True, None
        self._log.queries += 1
        self._query.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self._query.__exit__(*exception)
        self._log._in_query = False
        self._counted = self._log._last

    @property
    def samples(self) -> int:
        count = self._query.samples
        if self._counted is not None:
            self._log._take(self._counted, count)
            self._counted = None
        return int(count)


def _texel_bytes(texture: moderngl.Texture) -> int:
    return texture.components * int(texture.dtype[1])
