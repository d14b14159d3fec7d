"""Small rays: rays of one plane, traced by `ray-hierarchy`. Triangles cross this plane."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.gl.target import read_record
from gpgpu_rt.inspect.observe import ObservedPass
from gpgpu_rt.methods.ray_hierarchy.records import CHILDREN, PAIR

RAYS, TRIANGLES = 64, 9
PAIR_CHILDREN = "methods/ray_hierarchy/pair_children.frag"
THICK = 0.03    # triangles reach from z = -THICK to 2 * THICK; the rays lie in z = 0


@dataclass
class ConeLevel:
    """A level of the hierarchy of cones around rays, in world units.

    Attributes
    ----------
    centre, radius : (nodes, 3) and (nodes,), the spheres around the rays' origins
    axis : (nodes, 3), unit vectors, the axes of the cones
    chord : (nodes,), the largest distance between the axis and a ray's unit direction
    reach : (nodes,), the largest distance up to which a ray of the node searches
    """

    centre: np.ndarray
    radius: np.ndarray
    axis: np.ndarray
    chord: np.ndarray
    reach: np.ndarray

    @property
    def angle(self) -> np.ndarray:
        """Half-angles of the cones, radians."""
        return 2 * np.arcsin(np.minimum(self.chord / 2, 1))


@dataclass
class Round:
    """A round of the traversal: it tests pairs of a triangle and a node of one level.

    Attributes
    ----------
    pairs : (n, 2), the triangle and the node of each pair
    slots : (n, 4, 2), for each child of the node a pair of the same triangle and the child; -1 if
        no ray of the child can hit the triangle
    """

    level: int
    pairs: np.ndarray
    slots: np.ndarray

    @property
    def kept(self) -> int:
        return int((self.slots[..., 0] >= 0).sum())


def rays() -> tuple[np.ndarray, np.ndarray]:
    """Return (RAYS, 3) origins on a wavy mirror and mirrored directions, in the plane z = 0."""
    x = np.linspace(-1.0, 1.0, RAYS)
    origins = np.stack([x, 0.04 * np.sin(4 * x), 0 * x], 1)
    normals = np.stack([-0.16 * np.cos(4 * x), np.ones(RAYS), 0 * x], 1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    towards = origins - [0.0, 3.0, 0.0]
    directions = towards - 2 * (towards * normals).sum(1)[:, None] * normals
    return (origins.astype(np.float32),
            (directions / np.linalg.norm(directions, axis=1)[:, None]).astype(np.float32))


def scene() -> rt.Scene:
    """Return TRIANGLES triangles that cross the plane of the rays, in rows over the mirror."""
    at = np.stack([np.tile([-1.0, 0.0, 1.0], 3), np.repeat([0.9, 1.5, 2.1], 3)], 1)
    at += 0.15 * np.random.default_rng(5).normal(size=at.shape)
    corner = np.array([[-0.15, 0.0, -THICK], [0.15, 0.0, -THICK], [0.0, 0.0, 2 * THICK]])
    corners = np.pad(at, ((0, 0), (0, 1)))[:, None] + corner
    return rt.Scene.from_arrays(corners.reshape(-1, 3), np.arange(
        3 * TRIANGLES).reshape(-1, 3), name="small rays")


def tested(one: ObservedPass) -> tuple[np.ndarray, np.ndarray]:
    """Return the ``pairs`` that a pass read and the ``slots`` that it wrote (see `Round`)."""
    first, count = one.uniforms["base"], one.uniforms["last_element"] + 1
    pairs = read_record(PAIR, one.inputs, lambda texels: texels[first:first + count])
    fields = one.target.fields(by_ray=lambda texels: texels[:count])
    return (np.stack([pairs["triangle"], pairs["x"]], 1),
            np.stack([fields[field.name][:, :2] for field in CHILDREN.fields], 1))


@lru_cache(maxsize=1)
def traversal() -> tuple[list[ConeLevel], list[Round], rt.Hits]:
    """Return the levels of the hierarchy, the rounds and the hits, read from textures."""
    rounds: list[Round] = []
    # Size of a level's texture -> the level's fields. The tracer builds the hierarchy anew for
    # each batch of triangles; keep the fields of the last build.
    levels: dict[tuple[int, int], dict[str, np.ndarray]] = {}

    def look(one: ObservedPass) -> None:
        if one.name.split("/")[-1] in ("cone_rays.frag", "cone_level.frag"):
            levels[one.target.size] = one.target.fields()
        elif one.name == PAIR_CHILDREN:
            level = 1 + list(levels).index(one.uniforms["below"])
            rounds.append(Round(level, *tested(one)))
    with (rt.Tracer(scene(), "ray-hierarchy", top_nodes=1, statistics=True) as tracer,
          tracer.observe(look)):
        hits = tracer.trace(*rays(), shape=(1, RAYS))
        unit = tracer.accelerator.uniforms["unit"]
    return [_level(fields, unit) for fields in levels.values()], rounds, hits


def _level(fields: dict[str, np.ndarray], unit: float) -> ConeLevel:
    return ConeLevel(fields["centre"] / unit, fields["radius"] / unit, fields["axis"],
                     fields["chord"], fields["reach"] / unit)
