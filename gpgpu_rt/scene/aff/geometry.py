"""Geometry: the triangles of the geometric statements of AFF (BART's format), in file order."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..mesh import fans
from ..procedural.shapes import ball, tube
from .tokens import Tokens

BALL_TRIANGLES = 1280   # triangles of a sphere; also the default in JSON scene files
CONE_SIDES = 24


@dataclass(frozen=True, eq=False)
class Keys:
    """Positions of vertices at several times, interpolated linearly between these times.

    Attributes
    ----------
    times : (f,) times
    vertices : (f, v, 3) positions at each of ``times``
    """

    times: np.ndarray
    vertices: np.ndarray

    def at(self, time: float) -> np.ndarray:
        """Return the positions at a time, (v, 3). Positions are constant before the first time and
        after the last time."""
        last = len(self.times) - 1
        k = int(np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, max(last - 1, 0)))
        here, there = self.times[k], self.times[min(k + 1, last)]
        u = float(np.clip((time - here) / (there - here), 0, 1)) if there > here else 0.0
        return self.vertices[k] * (1 - u) + self.vertices[min(k + 1, last)] * u


@dataclass(frozen=True, eq=False)
class Geometry:
    """Triangles that share a material.

    Attributes
    ----------
    vertices : (v, 3) float64 positions in the coordinates of the statement
    faces : (n, 3) int64, the rows of ``vertices`` that are the corners of each triangle
    normals, uv : values at the corners, (n, 3, 3) and (n, 3, 2) float64, or None
    texture : the name of an image, or None
    keys : the positions of the vertices at several times, or None
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None
    texture: str | None = None
    keys: Keys | None = None

    @property
    def bytes(self) -> int:
        """The memory of the triangles, in bytes."""
        return sum(values.nbytes for values in (self.vertices, self.faces, self.normals, self.uv)
                   if values is not None)


def read_mesh(tokens: Tokens) -> Geometry:
    """Return the geometry of a statement ``m``, a mesh."""
    tokens.expect("vertices")
    vertices = _vectors(tokens, "vertices", 3)
    normals = uv = texture = None
    word = tokens.expect("normals", "texturecoords", "triangles")
    if word == "normals":
        normals = _vectors(tokens, "normals", 3)
        word = tokens.expect("texturecoords", "triangles")
    if word == "texturecoords":
        count = tokens.count("texturecoords", 2)
        texture = tokens.text("the name of a texture")
        uv = _upright(tokens.numbers(2 * count, "texture coordinates").reshape(-1, 2))
        word = tokens.expect("triangles")
    # A triangle has indices of normals only if the list of normals is not empty. The same applies
    # to texture coordinates.
    used = [("vertex", vertices), *((what, values) for what, values in (
        ("normal", normals), ("texture coordinate", uv)) if values is not None and len(values))]
    count = tokens.count("triangles", 3 * len(used))
    place = tokens.take(3 * len(used) * count, "triangles")
    rows = tokens.wholes(place).reshape(count, len(used), 3)
    for k, (what, values) in enumerate(used):
        outside = (rows[:, k] < 0) | (rows[:, k] >= len(values))
        if outside.any():
            face, corner = np.argwhere(outside)[0]
            raise tokens.error(
                f"a triangle names {what} {rows[face, k, corner]}, but the mesh has only "
                f"{len(values)}, counted from 0", place[int((face * len(used) + k) * 3 + corner)])
    corners = {what: values[rows[:, k]] for k, (what, values) in enumerate(used) if k}
    return Geometry(vertices, rows[:, 0], corners.get("normal"),
                    corners.get("texture coordinate"), texture)


def _vectors(tokens: Tokens, what: str, width: int) -> np.ndarray:
    return tokens.numbers(width * tokens.count(what, width), what).reshape(-1, width)


def _upright(uv: np.ndarray) -> np.ndarray:
    """Return texture coordinates whose v runs up. In AFF, v runs down from the image's top."""
    return uv * (1, -1) + (0, 1)


def read_polygons(tokens: Tokens, keyword: bytes) -> Geometry:
    """Return the geometry of consecutive statements ``p``, or ``pp`` (with normals)."""
    width = 6 if keyword == b"pp" else 3
    places = []
    while True:
        sides = tokens.count("vertices", width)
        if sides < 3:
            raise tokens.error(f"a polygon has {sides} vertices; give three or more",
                               tokens.at - 1)
        places.append(tokens.take(sides * width, "vertices"))
        if tokens.peek != keyword:
            break
        tokens.word("a polygon")
    rows = tokens.floats(*places).reshape(-1, width)
    sides = np.array([len(place) for place in places]) // width
    faces = fans(np.cumsum(sides) - sides, sides)[0]
    return Geometry(rows[:, :3], faces, rows[:, 3:][faces] if width == 6 else None)


def read_textured(tokens: Tokens, keyword: bytes) -> Geometry:
    """Return the geometry of consecutive statements with the same texture: ``tt`` (vertices and
    texture coordinates), or ``ttp`` (vertices, normals and texture coordinates)."""
    width = 8 if keyword == b"ttp" else 5
    texture, places = tokens.text("the name of a texture"), []
    while True:
        places.append(tokens.take(3 * width, "a textured triangle"))
        before = tokens.at
        if tokens.peek != keyword:
            break
        tokens.word("a triangle")
        if tokens.text("the name of a texture") != texture:
            tokens.at = before
            break
    rows = tokens.floats(*places).reshape(-1, width)
    corners = rows.reshape(-1, 3, width)
    return Geometry(rows[:, :3], _separate(len(rows)),
                    corners[..., 3:6] if width == 8 else None, _upright(corners[..., -2:]),
                    texture)


def read_animated(tokens: Tokens) -> Geometry:
    """Return the geometry of a statement ``tpa``: a triangle with vertices and normals at several
    times. Only the normals of the first time are used."""
    count = tokens.count("times", 19)
    if not count:
        raise tokens.error("an animated triangle has no times; give one or more", tokens.at - 1)
    place = tokens.take(19 * count, "an animated triangle")
    rows = tokens.floats(place).reshape(count, 19)
    times, corners = rows[:, 0], rows[:, 1:].reshape(count, 3, 6)
    if (np.diff(times) < 0).any():
        first = int(np.argmax(np.diff(times) < 0)) + 1
        raise tokens.error("the times of an animated triangle go back; give them in order",
                           place[19 * first])
    return Geometry(corners[0, :, :3], _separate(3), corners[:1, :, 3:], None, None,
                    Keys(times, corners[..., :3]))


def _separate(vertices: int) -> np.ndarray:
    """Return the faces of triangles that share no vertex."""
    return np.arange(vertices).reshape(-1, 3)


def read_sphere(tokens: Tokens) -> tuple[np.ndarray, Geometry]:
    """Read a statement ``s``, a sphere. Return a transform, (3, 4), and a unit ball, which the
    transform turns into the sphere."""
    *centre, radius = tokens.numbers(4, "a sphere's centre and radius")
    return np.column_stack([np.eye(3) * abs(radius), centre]), unit_ball()


@cache
def unit_ball() -> Geometry:
    """Return a ball of radius 1 around the origin."""
    triangles = ball(BALL_TRIANGLES)[:, ::-1]
    return Geometry(triangles.reshape(-1, 3), _separate(triangles.size // 3), triangles)


def read_cone(tokens: Tokens) -> Geometry:
    """Return the geometry of a statement ``c``: a cone or cylinder without end caps."""
    first = tokens.at
    rows = tokens.numbers(8, "a cone's two centres and radii").reshape(2, 4)
    if (rows[0, :3] == rows[1, :3]).all():
        raise tokens.error("the two ends of a cone coincide; move one of them", first)
    corners = tube(rows[:, :3], np.abs(rows[:, 3]), CONE_SIDES)[:, ::-1].reshape(-1, 3)
    return Geometry(corners, _separate(len(corners)))
