"""The log of a call's passes: draws, fragments, and bytes read and written.

``Tracer`` keeps a log with ``statistics=True``. Occlusion queries around each draw count the
fragments that pass the depth test and are not discarded.
"""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any

import moderngl

from ..statistics import Statistics
from .context import Gpu
from .observation import ObservedPass, Observer

AT_ONCE = 64    # largest number of queries in flight


@dataclass
class PassWork:
    """The total work of a program's draws.

    Attributes
    ----------
    name : the kernel or the file of the program
    texts : the (vertex, fragment) shader texts
    draws, fragments : number of draws and of fragments
    streams_read : bytes that fragments read from streams (textures other than tables), on the
        assumption that each fragment reads one texel of each texture
    tables : names of the sampled tables. ``gpgpu_rt.hardware`` counts the fetches
    texel_bytes : sampler -> bytes of a texel of the sampled texture
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


@dataclass
class PassLog(Observer):
    """Sums the work of each program in a call, and the bytes moved between host and card."""

    passes: dict[tuple[str, tuple[str, str]], PassWork] = field(default_factory=dict)
    queries: int = 0
    uploaded: int = 0
    read_back: int = 0
    _waiting: list[tuple[PassWork, ObservedPass, int, int]] = field(default_factory=list)

    counts = True

    def passed(self, one: ObservedPass) -> None:
        work = self.passes.get((one.label, one.texts))
        if work is None:
            work = self.passes[one.label, one.texts] = PassWork(one.label, one.texts)
            work.tables = tuple(sorted(n for n in one.inputs if n.endswith("_table")))
            work.texel_bytes = {name: _texel_bytes(t) for name, t in one.inputs.items()}
        work.draws += 1
        self._waiting.append((
            work, one, sum(_texel_bytes(t) for n, t in one.inputs.items()
                           if not n.endswith("_table")), sum(map(_texel_bytes, one.outputs))))
        if len(self._waiting) >= AT_ONCE:
            self._read()

    def moved(self, up: int, down: int) -> None:
        """Add bytes uploaded and read back."""
        self.uploaded += up
        self.read_back += down

    def queried(self) -> None:
        self.queries += 1

    def _read(self) -> None:
        for work, one, read_each, written_each in self._waiting:
            fragments = one.fragments or 0
            work.fragments += fragments
            work.streams_read += fragments * read_each
            work.written += fragments * written_each
        self._waiting = []

    def to_list(self) -> list[dict[str, Any]]:
        """Return each program's work as plain data, in the order in which programs first drew."""
        self._read()
        return [{key: value for key, value in asdict(one).items() if key != "texts"}
                for one in self.passes.values()]


@contextmanager
def logged(gpu: Gpu, statistics: Statistics) -> Iterator[PassLog]:
    """Log the passes within the block into the statistics."""
    with gpu.observed(log := PassLog()):
        yield log
    statistics.pass_log = log.to_list()
    statistics.uploaded_bytes, statistics.read_back_bytes = log.uploaded, log.read_back


def _texel_bytes(texture: moderngl.Texture) -> int:
    return texture.components * int(texture.dtype[1])
