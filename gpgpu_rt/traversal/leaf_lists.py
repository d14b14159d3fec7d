"""Leaf lists: the references to the triangles of a tree's leaves.

A list is usually counted: a leaf stores the number of its references, and a ray's state stores the
end of the list. In the era form with fp24, a pointer is two numbers. With such an end in the
state, kd-push-down and kd-texture-stack would need five render targets, but the cards have four.
So in this form, lists are marked: the last reference has a mark.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..gl.record import Record
from ..options import TEXEL_POINTERS
from .triangle_table import REFERENCE


def is_marked(options: Mapping[str, Any]) -> bool:
    """Return whether lists are marked under the tracer's options."""
    return options.get("era") in TEXEL_POINTERS


def leaf_tables(node: Record, fields: Mapping[str, np.ndarray], link: str, leaf: np.ndarray,
                references: np.ndarray, options: Mapping[str, Any]
                ) -> dict[str, dict[str, np.ndarray]]:
    """Return the tables of a tree's nodes and of its references.

    Parameters
    ----------
    node : the nodes' record
    fields : the nodes' fields, (nodes,) each, with ``count``
    link : the field that holds the index of a leaf's first reference
    leaf : (nodes,) bool, whether a node is a leaf
    references : (m,) int32, triangles
    options : the tracer's options. With marked lists, an empty leaf's ``link`` is -1
    """
    if not is_marked(options):
        return {node.name: dict(fields), REFERENCE.name: {"triangle": references}}
    first, lengths = fields[link], np.where(leaf, fields["count"], 0)
    marked = {**fields, link: np.where(leaf & (lengths == 0), -1, first)}
    del marked["count"]
    return {node.name: marked, REFERENCE.name: {
        "triangle": references, "last": last_of_leaves(first, lengths, references)}}


def last_of_leaves(first: np.ndarray, count: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Return flags of triangles in ``order``, (m,) int32: 1 for the last triangle of each leaf."""
    last = np.zeros(len(order), np.int32)
    leaf = count > 0
    last[(first + count)[leaf] - 1] = 1
    return last
