"""Warp packets: estimates the walk of a warp's packet of 32 rays from traces of small packets.

Packets of this project have at most 4x4 rays. In Günther et al. 2007 and Popov et al. 2007, each
warp traced a packet of 32 rays. A packet visits a node if any of its rays needs the node. The
large packet therefore visits all nodes that its parts (the small packets) visit. The large packet
is assumed to visit a node as often as the part with the most visits to this node. The result is a
lower bound: the large packet may find a hit later than one of its parts, and a later hit prunes
less.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .issue import in_groups
from .trace import KernelTrace

WARP = (8, 4)     # width and height of a warp's packet in rays
LANES = WARP[0] * WARP[1]


def growth(trace: KernelTrace, packet: tuple[int, int],
           places: Mapping[str, str]) -> dict[str, float]:
    """Return each kernel's growth, which says how much more the large packets cost.

    A visit of a packet costs as many lanes as the packet has rays. The growth is the cost of all
    visits of the large packets, divided by the cost of all visits of their parts. If the parts of
    each warp visit the same places, the growth is 1. If no two parts share a place, the growth is
    the number of parts.

    Parameters
    ----------
    trace : a trace of packets of a BVH or kd-tree under the schedule ``step``, with the fields of
        ``places``
    packet : (width, height) of the traced packets in rays
    places : kernel -> the field that names the node, or the position in a list of triangles, that
        the kernel visits
    """
    group = WARP[1] // packet[1], WARP[0] // packet[0]
    steps = in_groups(trace.steps, group)
    fields = {name: in_groups(trace.fields[name], group) for name in set(places.values())}
    found = {}
    for kernel, field in places.items():
        runs = steps == trace.kernels.index(kernel) + 1
        _, warp, part = np.nonzero(runs)
        found[kernel] = _growth(warp, part, fields[field][runs], group[0] * group[1])
    return found


def _growth(warp: np.ndarray, part: np.ndarray, place: np.ndarray, parts: int) -> float:
    """Return a kernel's growth. The three arrays have one entry for each run of the kernel.

    Parameters
    ----------
    warp : the warp whose part runs the kernel
    part : the part, from 0 to ``parts`` - 1
    place : the node or the list position that the part visits
    parts : the number of parts of a warp's packet
    """
    if not len(place):
        return 1.0
    ordered = (warp.astype(np.int64) << 32 | place) * parts + part
    visits, count = np.unique(ordered, return_counts=True)
    _, first = np.unique(visits // parts, return_index=True)
    return float(np.maximum.reduceat(count, first).sum() * parts / len(place))
