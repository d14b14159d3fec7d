"""Streams: lists of records in textures, and the passes that read and write streams.

A stream (a term of 2002-2007) has element i at texel i, in rows of TABLE_WIDTH texels. A pass runs
a fragment program once per element. The program can read any element i, at ``table_texel(i)``
(gather). To scatter, a pass draws points: the vertex stage reads an element and chooses the texels
of its points.
"""
from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType

import moderngl
import numpy as np

from ...errors import LimitError
from ..context import Gpu
from ..full_screen import FullScreenPass, Rectangles
from ..primitive_pass import PrimitivePass
from ..record import EXACT_INTEGER, TABLE_WIDTH_LOG2, Record
from ..target import Target
from ..textures import TABLE_WIDTH, bytes_of, note_moved, release


class Stream(Target):
    """A target of n records, the elements of the stream.

    Parameters
    ----------
    record : the record of an element; its name is the stream's name in GLSL
    length : number of elements
    arrays : initial elements by field name, (n,) or (n, width), if given
    """

    def __init__(self, gpu: Gpu, record: Record, length: int,
                 arrays: Mapping[str, np.ndarray] | None = None) -> None:
        if length > EXACT_INTEGER + 1:
            raise LimitError(f"a stream of {length:,} elements is past 2^24, the last index a "
                             "float texel holds exactly; use a smaller scene, or build on the "
                             "cpu")
        super().__init__(gpu, record, (TABLE_WIDTH, rows_of(length)))
        if arrays:
            self.write(record.name, **arrays)
        self.length = length

    def called(self, name: str) -> Stream:
        """Return the same elements under another name in GLSL."""
        other = copy.copy(self)
        other.records = {name: dataclasses.replace(self.record, name=name)}
        other.streams = {name: self.textures}
        return other

    def read(self, count: int | None = None) -> dict[str, np.ndarray]:
        """Read back the first ``count`` elements (default: all) by field name."""
        count = self.length if count is None else count
        return self.fields(by_ray=lambda texels: texels[:count])

    def read_one(self, i: int) -> dict[str, np.ndarray]:
        corner = (i % TABLE_WIDTH, i // TABLE_WIDTH, 1, 1)
        note_moved(self.textures[0], down=16 * len(self.textures))
        read = self.framebuffer.read
        texels = [np.frombuffer(read(corner, 4, attachment=k, dtype="f4"), np.float32)
                  for k in range(len(self.textures))]
        return {name: value[0]
                for name, value in self.record.unpack(np.stack(texels)[None]).items()}


class StreamRoom:
    """The streams and programs of a task, released at the end of the ``with`` block.

    Parameters
    ----------
    folder : the folder under ``glsl/`` for programs that are named without a folder
    """

    def __init__(self, gpu: Gpu, folder: str = "algorithms") -> None:
        self.gpu, self.folder, self.draws = gpu, folder, 0
        self._streams: list[Stream] = []
        self._passes: dict[object, FullScreenPass] = {}
        self._points: dict[object, PrimitivePass] = {}
        self._rectangles = Rectangles(gpu, 3)
        self._span: tuple[int, int] | None = None

    def __enter__(self) -> StreamRoom:
        self.gpu.context.enable_only(moderngl.NOTHING)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.gpu.context.enable_only(moderngl.NOTHING)
        self.gpu.context.blend_equation = moderngl.FUNC_ADD
        self.release()

    def stream(self, record: Record, length: int, **arrays: np.ndarray) -> Stream:
        """Return a new stream of ``length`` records, with initial fields if given."""
        stream = Stream(self.gpu, record, length, arrays)
        self._streams.append(stream)
        return stream

    def drop(self, *streams: Stream) -> None:
        """Release streams now."""
        for stream in streams:
            self._streams = [
                other for other in self._streams if other.textures is not stream.textures]
            stream.release()

    def draw(self, fragment: str, target: Target, reads: Sequence[Target] = (), *,
             first: int = 0, count: int | None = None,
             defines: Mapping[str, object] | None = None, **uniforms: object) -> None:
        """Run a program once for each element from ``first`` to ``first`` + ``count`` - 1.

        Parameters
        ----------
        reads : the streams that the program reads; a second stream of the same name is ignored
        """
        count = target.length - first if count is None else count
        if count <= 0:
            return
        records, samplers = _sources(reads, target.record)
        key = (fragment, records, tuple(sorted((defines or {}).items())))
        if key not in self._passes:
            self._passes[key] = FullScreenPass(self.gpu, f"{self._entry(fragment)}.frag", defines,
                                               {"records": records})
        self.draws += 1
        program = self._passes[key]
        program.set(last_element=first + count - 1, **uniforms)
        if self._span != (first, count):
            self._span = (first, count)
            self._rectangles.write(span(first, count))
        program.draw(target, samplers, rectangles=self._rectangles)

    def scatter(self, program: str, target: Target, reads: Sequence[Target], vertices: int, *,
                mode: int = moderngl.POINTS, defines: Mapping[str, object] | None = None,
                **uniforms: object) -> None:
        """Draw points or lines into the texels that the program's vertex stage chooses. The
        current blend mode combines several points in a texel."""
        if vertices <= 0:
            return
        records, samplers = _sources(reads, target.record)
        sources, _ = _sources(reads)
        words = "".join(f"#define {name} {value}\n" for name, value in (defines or {}).items())
        key = (program, records, words)
        if key not in self._points:
            self._points[key] = PrimitivePass(
                self.gpu, f"{self._entry(program)}.frag", f"{self._entry(program)}.vert",
                virtual={"records": words + records, "sources": words + sources})
        self.draws += 1
        drawn = self._points[key]
        drawn.set(**uniforms, target_rows=rows_of(target.length))
        drawn.draw(target, samplers, mode, vertices)

    def _entry(self, program: str) -> str:
        return program if "/" in program else f"{self.folder}/{program}"

    def bytes(self) -> int:
        return bytes_of(self._streams)

    def release(self) -> None:
        release(self._streams, self._passes, self._points, self._rectangles)
        self._streams, self._passes, self._points = [], {}, {}


def rows_of(length: int) -> int:
    """Return how many rows the textures of ``length`` elements have, at least 1."""
    return max(1, -(-length // TABLE_WIDTH))


def span(first: int, count: int) -> np.ndarray:
    """Return at most three rectangles, (k, 4), that cover ``count`` elements from ``first``."""
    (top, left), (bottom, right) = (divmod(i, TABLE_WIDTH) for i in (first, first + count))
    if top == bottom:
        parts = [(left, top, right, top + 1)]
    else:
        parts = [(left, top, TABLE_WIDTH, top + 1), (0, top + 1, TABLE_WIDTH, bottom),
                 (0, bottom, right, bottom + 1)]
    return np.array([(x0, y0, x1, y1) for x0, y0, x1, y1 in parts if x0 < x1 and y0 < y1],
                    np.float32).reshape(-1, 4)


def _sources(reads: Iterable[Target],
             written: Record | None = None) -> tuple[str, dict[str, moderngl.Texture]]:
    glsl = {} if written is None else {written.name: written.stream_glsl(True)}
    samplers: dict[str, moderngl.Texture] = {}
    for stream in reads:
        glsl.setdefault(stream.record.name, stream.record.stream_glsl(False))
        for name, texture in stream.samplers().items():
            samplers.setdefault(name, texture)
    text = f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}\n"
    return text + "\n".join(glsl.values()), samplers
