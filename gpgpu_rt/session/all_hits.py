"""All hits: everything that rays pass through, nearest first, found by tracing them on.

Hits are in the order of (t, triangle). After one at (t, triangle) a ray goes on with that t as its
t_min and takes, of the triangles at just that t, those of a higher index only: ``accept`` in
``glsl/core/triangle.glsl`` decides it, and every method calls that. So nothing is stepped over,
no offset is guessed, and triangles that coincide are all found. The t at which a ray goes on never
leaves the programs' own units, where it is exact.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import Error, OptionError
from ..hits import TRACED
from ..rays.batch import ROW, RayBatch
from ..rays.records import NO_RAY, NO_TRIANGLE, RAY_AFTER_HIT
from ..traversal.method import Method


@dataclass
class AllHits:
    """Hits of n rays, m in all, ray by ray in the order of (t, triangle).

    Attributes
    ----------
    ray : (m,) int64, which ray each hit is of; ascending
    t : (m,) float32, in units of the ray's |direction|
    u, v : (m,) float32, barycentric: p = (1 - u - v) v0 + u v1 + v v2
    triangle : (m,) int32, row of the scene's faces as given
    status : (n,) uint8, as of ``Hits``: of a ray that is not 0 there may be more hits
    shape : of the rays, as of ``Hits``
    """

    ray: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    status: np.ndarray
    shape: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        self.shape = tuple(self.shape) or (len(self.status),)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def count(self) -> np.ndarray:
        """(n,) int64, how many hits each ray has."""
        return np.bincount(self.ray, minlength=len(self.status))

    def image(self, name: str) -> np.ndarray:
        """``count`` or ``status`` in the shape that the rays had.

        Raises
        ------
        OptionError
            for another name
        """
        if name not in ("count", "status"):
            raise OptionError(f"hits have no image {name!r}; give count or status")
        return getattr(self, name).reshape(self.shape)


# (height, width, 3, 4) texels of RAY_AFTER_HIT -> fields of HIT and status, one entry a texel.
Round = Callable[[np.ndarray], tuple[dict[str, np.ndarray], np.ndarray]]


def collect(batch: RayBatch, trace: Round, max_hits: int | None = None) -> AllHits:
    """Trace rays on until none hits anything more.

    Parameters
    ----------
    batch : the rays
    trace : finds the nearest hit of rays that go on behind another
    max_hits : of a ray, or None for all of them
    """
    if max_hits is not None and max_hits < 0:
        raise OptionError(f"max_hits is {max_hits}; give 0 or more, or None for all")
    fields = {**batch.given_fields(), "after": np.full(batch.count, -1)}
    status = batch.status()
    # All in the first round, so that packets find their tiles; those put in order lack empty ones.
    rays = np.arange(batch.count) if batch.order is None else batch.order.rays
    found: list[dict[str, np.ndarray]] = []
    height, width = batch.size[::-1]
    while len(rays) and (max_hits is None or len(found) < max_hits):
        if 2 * len(rays) <= height * width:     # textures are kept until they are half empty
            height, width = -(-len(rays) // ROW), min(len(rays), ROW)
        image = np.repeat(NO_RAY[None], height * width, axis=0)
        RAY_AFTER_HIT.pack_into(image[:len(rays)].swapaxes(0, 1),
                                **{name: fields[name][rays] for name in fields})
        hits, ended = trace(image.reshape(height, width, *NO_RAY.shape))
        ended = ended[:len(rays)]
        # A ray that was stopped may have a nearer hit than the one it had found by then.
        status[rays[ended != TRACED]] = ended[ended != TRACED]
        some = np.flatnonzero((hits["triangle"][:len(rays)] != NO_TRIANGLE) & (ended == TRACED))
        rays = rays[some]
        one = {"ray": rays, **{name: values[some] for name, values in hits.items()}}
        t, triangle = fields["t_min"][rays], fields["after"][rays]
        if not ((one["t"] > t) | ((one["t"] == t) & (one["triangle"] > triangle))).all():
            raise Error("a ray went on behind a hit and came to it again: this renderer gives one "
                        "triangle two t; take context osmesa, or egl's software renderer")
        fields["t_min"][rays], fields["after"][rays] = one["t"], one["triangle"]
        found.append(one)
    return _ordered(batch, found, status)


def check_exact(method: Method, options: Mapping[str, Any]) -> None:
    """Raise OptionError where hits may be lost, or t is not what the test computed."""
    for option in method.options:
        if options[option.name] in option.relaxed:
            raise OptionError(f"{option.name}={options[option.name]} may lose hits, and all hits "
                              f"are asked for; leave it at {option.name}={option.default}")
    if (options["storage"], options["arithmetic"]) != ("fp32", "fp32"):
        raise OptionError("all hits are found in fp32 only: rounded t make one of several; leave "
                          "storage, arithmetic and precision at fp32")


def _ordered(batch: RayBatch, found: list[dict[str, np.ndarray]], status: np.ndarray) -> AllHits:
    """Rounds one behind the other -> rays one behind the other, in the caller's units."""
    kinds = {"ray": np.int64, "t": np.float32, "u": np.float32, "v": np.float32,
             "triangle": np.int32}
    parts = {name: np.concatenate([np.zeros(0, kind), *(one[name] for one in found)]).astype(kind)
             for name, kind in kinds.items()}
    parts["t"] = batch.given_units(parts["t"], parts["ray"])
    # By t and triangle once more: the caller's units may round two t to one.
    order = np.lexsort((parts["triangle"], parts["t"], parts["ray"]))
    return AllHits(**{name: values[order] for name, values in parts.items()}, status=status,
                   shape=batch.shape)
