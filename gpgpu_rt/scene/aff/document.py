"""Document: an AFF file with all included files, as instances under transforms."""
from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...disk.budget import check_bytes, check_triangles
from ...disk.files import read_input
from ..camera import Camera
from ..light import PointLight
from .geometry import Geometry
from .keyframes import KeyedMotion
from .statements import (
    Background, Close, Detail, Include, KeyFrames, Open, Span, Statement, read_statements
)
from .surface import Surface
from .tokens import Tokens

# Bytes that the memory budget counts for each statement of a file that is included again: four
# times the true size. Nested includes can repeat a file exponentially often; the high count stops
# the reader after about a second.
_STATEMENT_BYTES = 4096


@dataclass(frozen=True, eq=False)
class Node:
    """A transform: its parent's index, and its matrix (3, 4) or the name of its key frames."""

    parent: int
    transform: np.ndarray | str


@dataclass(frozen=True, eq=False)
class Instance:
    """A geometry under a transform.

    Attributes
    ----------
    node : index of the instance's transform
    geometry : the instance's triangles
    surface : the material, from the last fill statement (``f`` or ``fm``) before the instance;
        None without such a statement
    fill : stem of the file that holds this fill statement; "material" without such a statement
    part : stem of the file that holds the geometry
    """

    node: int
    geometry: Geometry
    surface: Surface | None
    fill: str
    part: str


@dataclass
class Document:
    """The content of an AFF file.

    Attributes
    ----------
    path : the file
    nodes : the transforms, each after its parent; the first is the identity
    instances : the geometry, in the order of the file
    motions : the key frames by name
    camera, background, span : the last statement of each kind, or None; ``span`` has the times of
        the frames
    lights : the point lights
    """

    path: Path
    nodes: list[Node] = field(default_factory=lambda: [Node(0, np.eye(3, 4))])
    instances: list[Instance] = field(default_factory=list)
    motions: dict[str, KeyedMotion] = field(default_factory=dict)
    camera: Camera | None = None
    background: Background | None = None
    span: Span | None = None
    lights: list[PointLight] = field(default_factory=list)

    @property
    def begin(self) -> float:
        """The time at which the animation begins, or 0."""
        return self.span.start if self.span else 0.0


def read_document(path: Path) -> Document:
    """Return the content of the file at ``path`` and of the files that it includes.

    Raises
    ------
    SceneError
        a file is wrong or missing, includes itself, or lies outside of the folder of ``path``; the
        message names the file and the line
    LimitError
        the included files exceed the memory budget; a file counts each time that it is included
    OSError
        the file at ``path`` cannot be read
    """
    return _Reader(path).document()


class _File:
    """A file: its statements, and its tokens for error messages."""

    def __init__(self, path: Path, name: str) -> None:
        content = read_input(path)
        self.name, self.size = name, len(content)
        self.stem = Path(name).stem
        self.tokens = Tokens(content, name)
        self.statements = read_statements(self.tokens)


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path, self.folder = path, os.path.realpath(path.parent)
        self.files = {os.path.realpath(path): _File(path, str(path))}
        self.places: dict[str, str] = {}    # the real path of each included name
        self.seen: set[int] = set()     # id() of each counted geometry
        self.triangles = self.repeated = self.size = 0

    def document(self) -> Document:
        """Build the document from the statements of all files."""
        made = Document(self.path)
        open_blocks = [0]
        surface, fill = None, "material"
        for file, said in self._statements():
            if isinstance(said, Geometry):
                self._count(said)
                made.instances.append(Instance(open_blocks[-1], said, surface, fill, file.stem))
            elif isinstance(said, Open):
                made.nodes.append(Node(open_blocks[-1], said.transform))
                open_blocks.append(len(made.nodes) - 1)
            elif isinstance(said, Close):
                open_blocks.pop()
            elif isinstance(said, Surface):
                surface, fill = said, file.stem
            elif isinstance(said, KeyFrames):
                made.motions[said.name] = said.motion
            elif isinstance(said, PointLight):
                made.lights.append(said)
            elif isinstance(said, Camera):
                made.camera = said
            elif isinstance(said, Background):
                made.background = said
            elif isinstance(said, Span):
                made.span = said
        return made

    def _statements(self) -> Iterator[tuple[_File, Statement]]:
        """Yield each statement with the file that contains it. An included file's statements
        replace the include statement."""
        top = os.path.realpath(self.path)
        level, opened = 0, {top: (self.files[top], iter(self.files[top].statements))}
        while opened:
            key = next(reversed(opened))
            file, rest = opened[key]
            for said in rest:
                if isinstance(said, Detail):
                    level = said.level
                elif not isinstance(said, Include):
                    yield file, said
                elif said.level <= level:
                    place = self._place(file, said)
                    if place in opened:
                        raise file.tokens.error(f"includes {said.name}, which includes this file; "
                                                "break the circle", said.at)
                    included = self._included(place, file, said)
                    opened[place] = included, iter(included.statements)
                    break
            else:
                del opened[key]

    def _place(self, file: _File, said: Include) -> str:
        """Return the real path of an included file, which must lie in the document's folder."""
        if said.name not in self.places:
            try:
                place = os.path.realpath(os.path.join(self.folder, said.name))
            except ValueError:      # the name contains a zero byte
                raise file.tokens.error("includes a file whose name no file can have", said.at
                                        ) from None
            if os.path.commonpath([self.folder, place]) != self.folder:
                raise file.tokens.error(f"includes {said.name}, which lies outside of the folder "
                                        f"{self.path.parent}; copy it there", said.at)
            self.places[said.name] = place
        return self.places[said.name]

    def _included(self, place: str, file: _File, said: Include) -> _File:
        included = self.files.get(place)
        if included is None:
            name = str(self.path.parent / said.name)
            try:
                included = self.files[place] = _File(Path(place), name)
            except FileNotFoundError:
                raise file.tokens.error(f"includes {said.name}, but there is no such file; put it "
                                        f"into {self.path.parent}", said.at) from None
            except OSError as failure:
                raise file.tokens.error(f"includes {said.name}, which cannot be read "
                                        f"({failure.strerror}); check it", said.at) from None
            self.size += included.size
        else:
            self._repeat(len(included.statements) * _STATEMENT_BYTES)
        return included

    def _count(self, geometry: Geometry) -> None:
        """Check the budget before the geometry of an instance is copied."""
        self.triangles += len(geometry.faces)
        check_triangles(self.triangles, f"{self.path} with its includes")
        if id(geometry) in self.seen:
            self._repeat(geometry.bytes)
        self.seen.add(id(geometry))

    def _repeat(self, size: int) -> None:
        self.repeated += size
        check_bytes(self.repeated, self.size, f"{self.path} with its includes")
