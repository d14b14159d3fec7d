"""Coherence: counts the different nodes of a BVH that the rays of a tile must visit."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.gl.algorithms.records import SORT_KEY
from gpgpu_rt.gl.target import read_record
from gpgpu_rt.inspect.observe import ObservedPass
from gpgpu_rt.methods.bvh.tree import Bvh

TILE = 64    # rays in a tile


def needed_nodes(bvh: Bvh, origins: np.ndarray, directions: np.ndarray,
                 t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the nodes whose boxes each ray meets before its hit. A traversal must visit these
    nodes.

    Parameters
    ----------
    origins, directions : (n, 3) float, without NaN
    t : (n,), the t at which each ray's search ends

    Returns
    -------
    rays, nodes : (pairs,) int each; a pair is a ray and a node whose box the ray meets
    """
    with np.errstate(divide="ignore"):
        inverse = 1.0 / np.where(directions == 0, np.float32(1e-20), directions)
    rays = np.arange(len(origins))
    nodes = np.zeros(len(origins), np.int64)
    found_rays, found_nodes = [], []
    while len(rays):
        ends = [(corner[nodes] - origins[rays]) * inverse[rays] for corner in (bvh.lo, bvh.hi)]
        enters = np.minimum(*ends).max(axis=1)
        leaves = np.maximum(*ends).min(axis=1)
        meets = (enters <= leaves) & (leaves >= 0) & (enters <= t[rays])
        rays, nodes = rays[meets], nodes[meets]
        found_rays.append(rays)
        found_nodes.append(nodes)
        inner = bvh.count[nodes] == 0
        rays, left = rays[inner], nodes[inner] + 1
        rays, nodes = np.concatenate([rays, rays]), np.concatenate([left, bvh.escape[left]])
    return np.concatenate(found_rays), np.concatenate(found_nodes)


def distinct_nodes(rays: np.ndarray, nodes: np.ndarray, tile_of: np.ndarray) -> float:
    """Return the mean number of different nodes that the rays of a tile must visit.

    Tiles whose rays visit no node do not count.

    Parameters
    ----------
    rays, nodes : pairs, as ``needed_nodes`` returns them
    tile_of : (n,) int, the tile of each ray
    """
    most = int(nodes.max(initial=0)) + 1
    pairs = np.unique(tile_of[rays].astype(np.int64) * most + nodes)
    return len(pairs) / max(1, len(np.unique(pairs // most)))


def tiles_of_image(size: int, side: int = 8) -> np.ndarray:
    """Return each ray's tile, (size squared,) int, for tiles of side x side pixels."""
    y, x = np.divmod(np.arange(size * size), size)
    return (y // side) * -(-size // side) + x // side


def tiles_of_order(order: np.ndarray) -> np.ndarray:
    """Return each ray's tile, (n,) int, for tiles of 64 consecutive rays of ``order``."""
    tiles = np.empty(len(order), np.int64)
    tiles[order] = np.arange(len(order)) // TILE
    return tiles


def divergence(steps: np.ndarray, tile_of: np.ndarray) -> float:
    """Measure how much longer rays take because each tile waits for its longest ray.

    Return the number of steps including the waits, divided by the number without the waits.
    """
    longest = np.zeros(tile_of.max() + 1, np.int64)
    np.maximum.at(longest, tile_of, steps)
    return float(longest[tile_of].sum() / max(1, steps.sum()))


@contextmanager
def observe_order(tracer: rt.Tracer) -> Iterator[list[np.ndarray]]:
    """Collect, for each trace in the context, the order into which the tracer sorts the rays.

    An order is (n,) int32, the indices of the rays in sorted order.
    """
    orders: list[np.ndarray] = []

    def look(one: ObservedPass) -> None:
        if one.name == "stages/sort_gather.frag":
            index = read_record(SORT_KEY, one.inputs)["index"]
            orders.append(index[:one.uniforms["elements"]])
    with tracer.observe(look):
        yield orders


def measure(scene: rt.Scene, rays: Workload) -> dict[str, float]:
    """Measure the coherence of a workload, in tiles of 8x8 pixels and in tiles of sorted rays."""
    shape, t_max = (rays.size, rays.size), np.inf if rays.t_max is None else rays.t_max
    with rt.Tracer(scene, "bvh-threaded", statistics=True, sort_rays=True) as tracer:
        with observe_order(tracer) as orders:
            hits = tracer.trace(rays.origins, rays.directions, t_max=t_max, shape=shape,
                                invalid="miss")
        order = orders[0]
        bvh = tracer.accelerator.structure
    live = np.flatnonzero(hits.status == 0)
    pairs, nodes = needed_nodes(bvh, rays.origins[live], rays.directions[live],
                                np.minimum(hits.t, t_max)[live])
    pairs = live[pairs]
    found = {"nodes_a_ray": len(pairs) / max(1, len(live))}
    for name, tiles in (("as_they_come", tiles_of_image(rays.size)),
                        ("sorted", tiles_of_order(order))):
        found[f"distinct_{name}"] = distinct_nodes(pairs, nodes, tiles)
        found[f"waiting_{name}"] = divergence(hits.steps, tiles)
    return found
