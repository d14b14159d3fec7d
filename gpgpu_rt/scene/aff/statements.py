"""Statements: reads the statements of one AFF file in order, without included files."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...errors import SceneError, nearest_names
from ..camera import Camera
from ..light import PointLight
from ..values import Vector, vector
from .geometry import (
    Geometry, read_animated, read_cone, read_mesh, read_polygons, read_sphere, read_textured
)
from .keyframes import FEWEST, KeyedMotion, RotationSpline, Spline
from .surface import Surface
from .tokens import Tokens

MOST_BLOCKS = 1000      # largest depth of nested blocks in a file; BART's files have at most 25


@dataclass(frozen=True, eq=False)
class Open:
    """The start of a block: its transform, (3, 4), or the name of its key frames."""

    transform: np.ndarray | str


@dataclass(frozen=True)
class Close:
    """The end of a block."""


@dataclass(frozen=True)
class Include:
    """A file that is included here, unless its level of detail is above the current level."""

    name: str
    level: int
    at: int


@dataclass(frozen=True)
class Detail:
    """The current level of detail for the following `Include` statements."""

    level: int


@dataclass(frozen=True)
class Background:
    """The colour behind the scene, (3,)."""

    colour: Vector


@dataclass(frozen=True)
class Span:
    """The times of an animation: ``frames`` frames from ``start`` to ``end``."""

    start: float
    end: float
    frames: int

    def time(self, frame: int) -> float:
        """Return the time of a frame."""
        return self.start + (self.end - self.start) * frame / max(self.frames - 1, 1)


@dataclass(frozen=True, eq=False)
class KeyFrames:
    """The motion of all transforms called ``name``, or of the camera."""

    name: str
    motion: KeyedMotion


Statement: TypeAlias = (Open | Close | Include | Detail | Background | Span | KeyFrames | Camera
                        | PointLight | Surface | Geometry)


def read_statements(tokens: Tokens) -> list[Statement]:
    """Return the statements of a file. Each `Open` has its `Close`.

    Raises
    ------
    SceneError
        the file is wrong; the message names the line
    """
    found: list[Statement] = []
    blocks: list[int] = []
    while tokens.peek:
        at = tokens.at
        keyword = tokens.word("a statement")
        if keyword == b"}":
            if not blocks:
                raise tokens.error("} closes no block; remove it", at)
            blocks.pop()
            found.append(Close())
            continue
        read = _READERS.get(keyword)
        if read is None:
            name = keyword[:40].decode("latin-1")
            raise tokens.error(f"no statement is called {name!r}"
                               f"{nearest_names(name, (word.decode() for word in _READERS))}", at)
        try:
            said = list(read(tokens, keyword))
        except SceneError as failure:   # a light or a camera has a value out of range
            if str(failure).startswith(tokens.name):
                raise
            raise tokens.error(str(failure), at) from None
        found += said
        if said and isinstance(said[-1], Open):
            blocks.append(at)
            if len(blocks) > MOST_BLOCKS:
                raise tokens.error(f"more than {MOST_BLOCKS:,} blocks are open; nest fewer", at)
    if blocks:
        raise tokens.error("the block that opens here is not closed; add }", blocks[-1])
    return found


def _view(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    tokens.expect("from")
    eye = tokens.numbers(3, "the camera's place")
    tokens.expect("at")
    target = tokens.numbers(3, "the camera's target")
    tokens.expect("up")
    up = tokens.numbers(3, "the camera's up direction")
    tokens.expect("angle")
    angle, = tokens.numbers(1, "an angle")
    tokens.expect("hither")     # the near plane; this program draws nearer objects as well
    tokens.numbers(1, "a distance")
    tokens.expect("resolution")
    tokens.numbers(2, "the resolution")
    yield Camera(tuple(eye), tuple(target), tuple(up), angle)


def _background(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    colour = tokens.numbers(3, "the background's colour")
    yield Background(vector(colour, "background", 0))


def _ambient(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    tokens.numbers(3, "the ambient light")      # ignored: the environment lights the scene instead
    yield from ()


def _light(tokens: Tokens, keyword: bytes) -> Iterator[Statement]:
    if keyword == b"la":
        tokens.word("the name of a light")      # ignored: lights do not move
    place = tokens.numbers(3, "a light's place")
    colour = np.ones(3)
    if _is_number(tokens.peek):
        colour = tokens.numbers(3, "a light's colour")
    yield PointLight(tuple(place), tuple(colour))


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _fill(tokens: Tokens, keyword: bytes) -> Iterator[Statement]:
    if keyword == b"fm":
        said = tokens.numbers(12, "a material's numbers")
        shares, (_, transmittance, ior) = said[:9].reshape(3, 3), said[9:]
    else:
        said = tokens.numbers(8, "a material's numbers")
        colour, (kd, ks, _, transmittance, ior) = said[:3], said[3:]
        shares = np.stack([0 * colour, kd * colour, np.full(3, ks)])
    yield Surface.of(*shares, transmittance, ior)


def _static(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    said = tokens.numbers(10, "a transform's numbers")
    tokens.expect("{")
    transform = np.empty((3, 4))
    transform[:, :3] = rotation(said[3:6], said[6]) * said[:3]
    transform[:, 3] = said[7:]
    yield Open(transform)


def rotation(axis: np.ndarray, degrees: float) -> np.ndarray:
    """Return the matrix of a rotation around an axis of any length, (3, 3), by Rodrigues' formula;
    the identity for an axis of length 0."""
    length = float(np.sqrt((axis * axis).sum()))
    if not length > 0:
        return np.eye(3)
    x, y, z = (axis / length).tolist()
    angle = np.radians(degrees)
    c, s = float(np.cos(angle)), float(np.sin(angle))
    v = 1 - c
    return np.array([[x * x * v + c, x * y * v - z * s, x * z * v + y * s],
                     [y * x * v + z * s, y * y * v + c, y * z * v - x * s],
                     [z * x * v - y * s, z * y * v + x * s, z * z * v + c]])


def _moving(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    name = tokens.text("the name of a transform")
    tokens.expect("{")
    yield Open(name)


def _include(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    at = tokens.at - 1
    level = int(tokens.wholes(tokens.take(1, "a level of detail"))[0])
    yield Include(tokens.text("the name of a file"), level, at)


def _detail(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    yield Detail(int(tokens.wholes(tokens.take(1, "a level of detail"))[0]))


def _span(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    start, end = tokens.numbers(2, "the times of the animation")
    frames = int(tokens.wholes(tokens.take(1, "the number of frames"))[0])
    if frames < 1:
        raise tokens.error(f"the animation has {frames} frames; give one or more", tokens.at - 1)
    yield Span(float(start), float(end), frames)


def _key_frames(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    name = tokens.text("the name of a motion")
    tokens.expect("{")
    said: dict[str, np.ndarray] = {}
    while tokens.peek != b"}":
        part = tokens.expect("transl", "rot", "scale", "visibility")
        if part in said:
            raise tokens.error(f"{part} stands twice in a motion; leave one out", tokens.at - 1)
        width, fewest = _COLUMNS[part], 1 if part == "visibility" else FEWEST
        count = tokens.count("key frames", width)
        if count < fewest:
            raise tokens.error(f"{part} has {count} key frames; give {fewest} or more",
                               tokens.at - 1)
        said[part] = tokens.numbers(count * width, "key frames").reshape(count, width)
    tokens.expect("}")
    with np.errstate(over="ignore", invalid="ignore"):  # mesh.py refuses infinite vertices
        yield KeyFrames(name, KeyedMotion(
            Spline(said["transl"]) if "transl" in said else None,
            RotationSpline(said["rot"]) if "rot" in said else None,
            Spline(said["scale"]) if "scale" in said else None, said.get("visibility")))


_COLUMNS = {"transl": 7, "rot": 8, "scale": 7, "visibility": 2}


def _mesh(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    yield read_mesh(tokens)


def _polygons(tokens: Tokens, keyword: bytes) -> Iterator[Statement]:
    yield read_polygons(tokens, keyword)


def _textured(tokens: Tokens, keyword: bytes) -> Iterator[Statement]:
    yield read_textured(tokens, keyword)


def _animated(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    yield read_animated(tokens)


def _sphere(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    transform, ball = read_sphere(tokens)
    yield from (Open(transform), ball, Close())


def _cone(tokens: Tokens, _: bytes) -> Iterator[Statement]:
    yield read_cone(tokens)


_READERS: Mapping[bytes, Callable[[Tokens, bytes], Iterator[Statement]]] = {
    b"v": _view, b"b": _background, b"am": _ambient, b"l": _light, b"la": _light, b"f": _fill,
    b"fm": _fill, b"xs": _static, b"x": _moving, b"i": _include, b"d": _detail, b"a": _span,
    b"k": _key_frames, b"m": _mesh, b"p": _polygons, b"pp": _polygons, b"tt": _textured,
    b"ttp": _textured, b"tpa": _animated, b"s": _sphere, b"c": _cone}
