"""All hits: every triangle that a ray passes through, nearest first, found by repeated tracing.

Hits are in the order of (t, triangle). After a hit, the ray continues with the hit's t as its
t_min. At exactly this t, the ray accepts only triangles with a higher index than the hit triangle
(``accept`` in ``glsl/core/triangle.glsl``). No hit is skipped, no offset is needed, and all
coincident triangles are found.
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
from ..text_format import counted
from ..traversal.method import Method


@dataclass
class AllHits:
    """All hits of n rays, m in total, sorted by ray, then by (t, triangle).

    A far origin moves along its ray for the search (``rays/far_origins.py``). The distance of the
    move is then added to t. Hits keep the order of the search, even if two t become equal.

    Attributes
    ----------
    ray : (m,) int64, index of each hit's ray, ascending
    t : (m,) float32, in units of the ray's |direction|
    u, v : (m,) float32, barycentric: p = (1 - u - v) v0 + u v1 + v v2
    triangle : (m,) int32, row of the scene's faces as given
    status : (n,) uint8, as in ``Hits``; some hits may be missing for a ray whose status is not 0
    shape : shape of the rays, as in ``Hits``
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

    def __repr__(self) -> str:
        return f"AllHits({counted(len(self.status), 'ray')}: {counted(len(self), 'hit')})"

    @property
    def count(self) -> np.ndarray:
        """The number of hits of each ray, (n,) int64."""
        return np.bincount(self.ray, minlength=len(self.status))

    def image(self, name: str) -> np.ndarray:
        """Return ``count`` or ``status`` in the shape of the rays.

        Raises
        ------
        OptionError
            for another name
        """
        if name not in ("count", "status"):
            raise OptionError(f"hits have no image {name!r}; give count or status")
        return getattr(self, name).reshape(self.shape)


# Traces rays once, given as (height, width, 3, 4) texels of RAY_AFTER_HIT. Returns the fields of
# HIT and the status of each ray.
Round = Callable[[np.ndarray], tuple[dict[str, np.ndarray], np.ndarray]]


def collect(batch: RayBatch, trace: Round, max_hits: int | None = None) -> AllHits:
    """Trace rays repeatedly until no ray has a further hit.

    Parameters
    ----------
    batch : the rays
    trace : finds the nearest hits of rays that continue after a hit
    max_hits : largest number of hits of a ray; None for all

    Raises
    ------
    OptionError
        for a negative ``max_hits``
    Error
        if the renderer computes different t for the same ray and triangle
    """
    if max_hits is not None and max_hits < 0:
        raise OptionError(f"max_hits is {max_hits}; give 0 or more, or None for all")
    fields = {**batch.given_fields(), "after": np.full(batch.count, -1)}
    status = batch.status()
    # Trace rays with empty intervals too in the first round: without them, packets would not cover
    # tiles of the image. If the rays were sorted, `batch.order` omits such rays.
    rays = np.arange(batch.count) if batch.order is None else batch.order.rays
    found: list[dict[str, np.ndarray]] = []
    height, width = batch.size[::-1]
    while len(rays) and (max_hits is None or len(found) < max_hits):
        if 2 * len(rays) <= height * width:     # shrink textures once they are half empty
            height, width = -(-len(rays) // ROW), min(len(rays), ROW)
        image = np.repeat(NO_RAY[None], height * width, axis=0)
        RAY_AFTER_HIT.pack_into(image[:len(rays)].swapaxes(0, 1),
                                **{name: fields[name][rays] for name in fields})
        hits, ended = trace(image.reshape(height, width, *NO_RAY.shape))
        ended = ended[:len(rays)]
        # Drop the hit of a ray whose trace stopped early: the ray may have a nearer hit.
        status[rays[ended != TRACED]] = ended[ended != TRACED]
        some = np.flatnonzero((hits["triangle"][:len(rays)] != NO_TRIANGLE) & (ended == TRACED))
        rays = rays[some]
        one = {"ray": rays, **{name: values[some] for name, values in hits.items()}}
        t, triangle = fields["t_min"][rays], fields["after"][rays]
        if not ((one["t"] > t) | ((one["t"] == t) & (one["triangle"] > triangle))).all():
            raise Error("a ray continued after a hit and found it again: this renderer computes "
                        "different t for the same ray and triangle; use context osmesa, or egl's "
                        "software renderer")
        fields["t_min"][rays], fields["after"][rays] = one["t"], one["triangle"]
        found.append(one)
    return _ordered(batch, found, status)


def check_exact(method: Method, options: Mapping[str, Any]) -> None:
    """Raise OptionError for options that may lose hits or round t."""
    for option in method.options:
        if options[option.name] in option.relaxed:
            raise OptionError(f"{option.name}={options[option.name]} may lose hits, but all hits "
                              f"are needed; set {option.name}={option.default}")
    if (options["storage"], options["arithmetic"]) != ("fp32", "fp32"):
        raise OptionError("all hits are found in fp32 only: rounding makes different t equal; "
                          "leave storage, arithmetic and precision at fp32")


def _ordered(batch: RayBatch, found: list[dict[str, np.ndarray]], status: np.ndarray) -> AllHits:
    """Return the hits of all rounds, ray by ray in the order of the rounds, in the caller's units.
    """
    kinds = {"ray": np.int64, "t": np.float32, "u": np.float32, "v": np.float32,
             "triangle": np.int32}
    parts = {name: np.concatenate([np.zeros(0, kind), *(one[name] for one in found)]).astype(kind)
             for name, kind in kinds.items()}
    parts["t"] = batch.given_units(parts["t"], parts["ray"])
    # Each round is sorted by ray, and later rounds have later hits of a ray.
    order = np.argsort(parts["ray"], kind="stable")
    return AllHits(**{name: values[order] for name, values in parts.items()}, status=status,
                   shape=batch.shape)
