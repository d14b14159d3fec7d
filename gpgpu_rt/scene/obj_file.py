"""OBJ file: reads Wavefront's mesh format in a time that depends only on the file's size.

trimesh's reader needs more time and memory with each change of the material. It drops normals and
texture coordinates unless all corners of a material have them, and it reorders faces if some faces
are quads. This reader keeps the order of the faces. It keeps normals and texture coordinates of
every face that has them at all corners.
"""
from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..disk.files import decoded, is_file, read_input
from .mesh import Mesh, fans, fill_normals, filled, unlike
from .mesh_material import Textures
from .mtl_file import LibraryMaterial, read_library

UNPAINTED = 0.7     # grey of faces without a colour, in a file that colours other faces
_AFTER = (32, 9, 10)    # bytes that end a word: space, tab, newline


def read_obj(path: Path, groups: bool) -> Mesh:
    """Return the mesh of a file, with each polygon cut into consecutive triangles.

    Parameters
    ----------
    path : the OBJ file
    groups : whether the file's groups become parts of the mesh; if the file has no groups, its
        objects become parts

    Raises
    ------
    ValueError
        the file is wrong; some messages name the first wrong line
    SceneError
        a texture of a material cannot be read
    """
    text = _Text(read_input(path))
    points = text.numbers(b"v", 3)
    corners = _Corners.of(text, len(points))
    n = len(corners.place)
    vertex_colours = points[:, 3:] if points.shape[1] == 6 else None
    names, material_of = text.named_before(b"usemtl", corners.line, "")
    libraries = _libraries(path, text)
    textures = Textures(path.parent)
    made = [libraries[name].material(textures) if name in libraries else None for name in names]
    shared, rows = unlike(made)
    known = np.array([m is not None for m in made], bool)[material_of]
    colours = None
    if known.any() or vertex_colours is not None:
        colours = np.full((n, 3), UNPAINTED, np.float32)
        if vertex_colours is not None:
            shares = np.clip(np.nan_to_num(vertex_colours), 0, 1)
            colours = shares[corners.place].mean(axis=1).astype(np.float32)
        if known.any():
            diffuse = np.array([m.diffuse if m else (0, 0, 0) for m in made], np.float32)
            colours[known] = diffuse[material_of[known]]
    word = b"g" if len(text.rows(b"g")) else b"o"
    parts, part_of = (text.named_before(word, corners.line, path.name) if groups
                      else ([path.name], np.zeros(n, np.int64)))
    uv = filled([_picked(text.numbers(b"vt", 1), corners.uv, 2)], [n], 2)
    normals = filled([_picked(text.numbers(b"vn", 3), corners.normal, 3)], [n], 3)
    mesh = Mesh(points[:, :3], corners.place, colours, shared, rows[material_of].astype(np.int32),
                normals, uv, tuple(parts), part_of.astype(np.int32))
    fill_normals(mesh)
    return mesh


def _picked(values: np.ndarray, at: np.ndarray, width: int) -> np.ndarray | None:
    """Return the values of corners, (n, 3, width). A face that lacks the value of a corner gets
    zeros. Return None if every face lacks a value."""
    some = ((at >= 0) & (at < len(values))).all(axis=1)
    if not some.any():
        return None
    if values.shape[1] < width:     # lines ``vt`` of curves have one number each
        values = np.pad(values, ((0, 0), (0, width - values.shape[1])))
    found = np.zeros((len(at), 3, width))
    found[some] = values[at[some], :width]
    return found


def _libraries(path: Path, text: _Text) -> dict[str, LibraryMaterial]:
    """Return the materials of all libraries of the file, by name; warn of unreadable libraries."""
    found: dict[str, LibraryMaterial] = {}
    for row in text.rows(b"mtllib"):
        name = text.body(row, b"mtllib")
        library = path.parent / name
        try:
            found.update(read_library(library))
        except (OSError, ValueError) as failure:
            why = (f"no such file of materials {name}" if not is_file(library)
                   and isinstance(failure, FileNotFoundError) else
                   f"the file of materials {name} cannot be read "
                   f"({getattr(failure, 'strerror', None) or failure})")
            warnings.warn(f"{path}: {why}; surfaces of its materials are grey", stacklevel=6)
    return found


class _Corners(NamedTuple):
    """The corners of n triangles. ``place``, ``uv`` and ``normal`` are (n, 3) int64 indices of
    vertices, texture coordinates and normals; a missing index is negative. ``line``, (n,), is the
    line of each triangle's face."""

    place: np.ndarray
    uv: np.ndarray
    normal: np.ndarray
    line: np.ndarray

    @classmethod
    def of(cls, text: _Text, points: int) -> _Corners:
        """Return the corners of a file's faces. Raise ValueError for a face with a vertex beyond
        the file's ``points`` vertices."""
        rows = text.rows(b"f")
        words = [text.lines[row][1:].split() for row in rows.tolist()]
        sides = np.fromiter(map(len, words), np.int64, len(words))
        indices = _indices([word for face in words for word in face])
        line = np.repeat(rows, sides)
        for column, word in enumerate((b"v", b"vt", b"vn")):
            _count_from_zero(indices[:, column], text.rows(word), line)
        wrong = (indices[:, 0] < 0) | (indices[:, 0] >= points)
        if wrong.any():
            first = int(np.argmax(wrong))
            raise ValueError(f"line {line[first] + 1}: a face names a vertex that does not "
                             f"exist; the file has {points} vertices")
        first = np.cumsum(sides) - sides
        at, face = fans(first, sides)
        picked = indices[at]
        return cls(picked[..., 0], picked[..., 1], picked[..., 2], rows[face])


def _indices(words: Sequence[bytes]) -> np.ndarray:
    """Return the (n, 3) int64 indices of corners written as v, v/vt, v//vn or v/vt/vn; 0 if
    missing."""
    missing = {0: b"/0/0", 1: b"/0", 2: b""}
    try:
        whole = b"/".join([word + missing[word.count(b"/")] for word in words])
    except KeyError:
        raise ValueError("a corner of a face has more than three indices") from None
    for _ in range(2):
        whole = whole.replace(b"//", b"/0/")
    numbers = (whole + b"0" if whole.endswith(b"/") else whole).split(b"/") if whole else []
    if max(map(len, numbers), default=0) > 18:
        raise ValueError("an index of a face has more than 18 digits")
    return np.fromiter(map(int, numbers), np.int64, len(numbers)).reshape(-1, 3)


def _count_from_zero(index: np.ndarray, declared: np.ndarray, line: np.ndarray) -> None:
    """Convert a file's indices in place, so that they count from 0. In the file, a negative index
    counts back from the last value before the index's line. In the result, a negative index means
    that the file gives no index, or an index before the first value."""
    back = index < 0
    if back.any():
        before = np.searchsorted(declared, line[back])
        index[back] = np.maximum(before + index[back], -2)
    index[~back] -= 1


class _Text:
    """The lines of an OBJ file, indexed by their first word."""

    def __init__(self, content: bytes) -> None:
        if b"\r" in content:
            content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        content = content.replace(b"\\\n", b" ")     # join continued lines
        self.lines = content.split(b"\n")
        if re.search(rb"^[ \t]", content, re.MULTILINE):
            self.lines = [line.lstrip(b" \t") for line in self.lines]
            content = b"\n".join(self.lines)
        # Pad with newlines, so that `rows` may look past the end of the last line.
        buffer = np.frombuffer(content + b"\n" * 8, np.uint8)
        ends = np.flatnonzero(buffer[:len(content) + 1] == 10)
        self._starts = np.concatenate([[0], ends[:-1] + 1])
        self._buffer = buffer
        self._found: dict[bytes, np.ndarray] = {}

    def rows(self, word: bytes) -> np.ndarray:
        """Return the indices of the lines that begin with a word, ascending."""
        if word not in self._found:
            some = np.ones(len(self._starts), bool)
            for k, letter in enumerate(word):
                some &= self._buffer[np.minimum(self._starts + k, len(self._buffer) - 1)] == letter
            rows = np.flatnonzero(some)
            after = self._buffer[np.minimum(self._starts[rows] + len(word),
                                            len(self._buffer) - 1)]
            self._found[word] = rows[np.isin(after, _AFTER)]
        return self._found[word]

    def body(self, row: int, word: bytes) -> str:
        """Return the text of a line after its first word."""
        return decoded(self.lines[row][len(word):].strip())

    def columns(self, word: bytes) -> int:
        """Return the smallest number of values in the lines that begin with ``word``."""
        rows = self.rows(word).tolist()
        return min((len(self.lines[row].split(None, 7)) - 1 for row in rows), default=0)

    def numbers(self, word: bytes, least: int) -> np.ndarray:
        """Return (n, k) float64 with k >= ``least``: the numbers in the lines that begin with a
        word.

        Raises
        ------
        ValueError
            a line holds a non-number or too few numbers; the message names the first such line
        """
        rows = self.rows(word).tolist()
        width = min(max(self.columns(word), least), 6)
        words = [self.lines[row].split(None, width + 1)[1:width + 1] for row in rows]
        try:
            flat = [float(one) for line in words for one in line]
        except ValueError:
            flat = []
        if len(flat) != width * len(rows):
            raise ValueError(self._what_is_wrong(rows, words, least))
        return np.array(flat, np.float64).reshape(-1, width)

    def _what_is_wrong(self, rows: Sequence[int], words: Sequence[Sequence[bytes]],
                       least: int) -> str:
        for row, line in zip(rows, words):
            try:
                whole = len(list(map(float, line))) >= least
            except ValueError:
                whole = False
            if not whole:
                return f"line {row + 1} is {decoded(self.lines[row])[:40]!r}; give numbers"
        return "its lines have too few numbers; give the same count in each line"

    def named_before(self, word: bytes, lines: np.ndarray, default: str
                     ) -> tuple[list[str], np.ndarray]:
        """Return the distinct names of ``lines``, and for each line the index of its name. A line
        that begins with ``word``, such as ``usemtl``, gives the name of all lines up to the next
        such line. Before the first such line, the name is ``default``."""
        rows = self.rows(word)
        said = [default, *(self.body(row, word) or default for row in rows.tolist())]
        used, which = np.unique(np.searchsorted(rows, lines), return_inverse=True)
        names = list(dict.fromkeys(said[k] for k in used.tolist()))
        place = {name: k for k, name in enumerate(names)}
        return names, np.array([place[said[k]] for k in used.tolist()], np.int64)[
            which.reshape(-1)] if len(used) else np.zeros(len(lines), np.int64)
