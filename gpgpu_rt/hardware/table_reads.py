"""Table reads: finds the addresses of the table texels that rays fetch, from a trace of kernels.

A ray's state names the record that its next kernel reads: the node to visit, or the position in a
list of triangles. The trace has these fields (``FIELDS``), so fetches need not be observed.
"""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..errors import OptionError
from ..gl.record import Record
from ..methods.bvh.records import BVH_NODE
from ..methods.kdtree.records import KD_NODE
from ..traversal.triangle_table import REFERENCE, TRIANGLE
from .issue import in_groups
from .trace import KernelTrace

FIELDS = ("node", "cursor")
TABLES = (KD_NODE, BVH_NODE, REFERENCE, TRIANGLE)
# The records that each kernel reads, in order. `push` and `pop` access only the stack.
READS: Mapping[str, tuple[Record, ...]] = {
    "down": (KD_NODE,), "traverse": (BVH_NODE,), "intersect": (REFERENCE, TRIANGLE),
    "push": (), "pop": ()}
TABLE = 1 << 40     # distance between the first addresses of consecutive tables


def table_reads(trace: KernelTrace, tables: Mapping[str, Mapping[str, Any]],
                group: tuple[int, int]) -> np.ndarray:
    """Return the places that rays read, (reads,) int64, one group of (h, w) rays after another.

    A place is an address: a byte's offset in its table, plus the table's number times TABLE. In
    each step, the rays of a group that run the same kernel read in lockstep, texel by texel.

    Parameters
    ----------
    trace : a trace of single rays of a kd-tree or a threaded BVH, with FIELDS
    tables : the fields of the method's tables (``Accelerator.tables``)
    group : (h, w) of the rays that fetch together

    Raises
    ------
    OptionError
        for a kernel whose reads are not known
    """
    unknown = [kernel for kernel in trace.kernels if kernel not in READS or not all(
        record is REFERENCE or record.name in tables for record in READS[kernel])]
    if unknown:
        raise OptionError(f"the reads of kernel {unknown[0]} are not known; trace kd-restart, "
                          "kd-texture-stack or bvh-threaded")
    steps, fields = (_by_group(trace.steps, group), {
        name: _by_group(trace.fields[name], group) for name in FIELDS})
    places, order = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for number, kernel in enumerate(trace.kernels, 1):
        runs = steps == number
        moment = np.flatnonzero(runs) // steps.shape[2]     # number of (group, step)
        index = {name: values[runs].astype(np.int64) for name, values in fields.items()}
        for read in _places(READS[kernel], index, tables):
            places.append(read)
            order.append(moment)
    return np.concatenate(places)[np.argsort(np.concatenate(order), kind="stable")]


def _by_group(values: np.ndarray, group: tuple[int, int]) -> np.ndarray:
    """Return values (n, h, w) as (groups, n, lanes)."""
    return in_groups(values, group).transpose(1, 0, 2)


def _places(records: tuple[Record, ...], index: Mapping[str, np.ndarray],
            tables: Mapping[str, Mapping[str, Any]]) -> Iterator[np.ndarray]:
    """For each texel that a kernel reads, yield the places of all runs of the kernel."""
    at = index["cursor" if TRIANGLE in records else "node"]
    for record in records:
        if record.name not in tables:
            continue        # without references, a BVH's cursor is a row of the triangle table
        (plane,) = record.planes
        texel_bytes = plane.components * np.dtype(plane.dtype).itemsize
        for texel in range(plane.texels):
            yield TABLES.index(record) * TABLE + (at * plane.texels + texel) * texel_bytes
        if record is REFERENCE:
            at = np.asarray(tables[record.name]["triangle"])[at].astype(np.int64)
