"""The BVH family: rows of the method table for threaded trees and trees with a stack."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...gl.record import EXACT_INTEGER
from ...options import OFF, TEXEL_POINTERS, Option
from ...traversal.leaf_lists import last_of_leaves
from ...traversal.method import (
    CULLING, ENTRY_POINTS, PACKET, PACKET_ENTRIES, TRIANGLE_TESTS, VERTEX_CULLING, Accelerator,
    Method, Part, Stepwise, check_culling, stack_defines, with_entries
)
from ...traversal.packet_steps import PacketSteps
from ...traversal.packets import PacketTraversal
from ...traversal.records import BVH_ENTERING, PACKET_STATE, STACK_ENTRY, STATE, TREE_STATE
from ...traversal.triangle_table import TRIANGLE, triangle_table
from .build import node_limit
from .builders import BUILD_OPTIONS, automatic_values, built_bvh
from .octant_copies import OctantCopies, times_stored
from .ray_streams import RayStreams
from .records import BVH_NODE, BVH_PAIR, PACKET_SHARED_STATE, PACKET_STACK_STATE, SHARED_WAY_OUT
from .refit import REBUILD_RATIO, Refitter
from .tables import Layout, Options, Pairs, Threads, scene_box
from .tree import Bvh

LayoutOf = Callable[[Options], type[Layout]]


@dataclass
class _Kept:
    """Data that stay valid when the tree's boxes change.

    Attributes
    ----------
    layout : the arrangement of the nodes
    last : (m,) int32, 1 for the last triangle of each leaf
    refitter : the data for refitting the tree; None until the first refit
    """

    layout: Layout
    last: np.ndarray
    refitter: Refitter | None = None


def _built(triangles: np.ndarray, options: Options) -> Bvh:
    def limited(copies: float) -> Bvh:
        return built_bvh(triangles, options, **node_limit(len(triangles), copies))
    if not options.get("octants"):
        return limited(1)
    shared = options["shared_subtrees"]
    bvh = limited(times_stored(shared))
    if shared and 8 * len(bvh.escape) > EXACT_INTEGER and (
            OctantCopies.of(bvh, shared_subtrees=shared).records > EXACT_INTEGER):
        # An unbalanced tree shares few nodes: build it again, within the limit for whole copies.
        return limited(8)
    return bvh


def _accelerator(bvh: Bvh, kept: _Kept, triangles: np.ndarray,
                 options: Options) -> Accelerator:
    layout = kept.layout
    fields, uniforms = layout.fields(bvh, options)
    lo, hi = scene_box(bvh)
    width, height = options.get("packet", (1, 1))
    # With entry points, a walk through a list of nodes needs an extra step to find the list's end.
    ends = 1 if options.get("entry_points") else 0
    return Accelerator(
        {**triangle_table(triangles, bvh.order, kept.last), layout.record(options).name: fields},
        {"scene_lo": tuple(lo), "scene_hi": tuple(hi), **layout.uniforms, **uniforms},
        # A packet needs at most as many steps as its rays would need one after another.
        step_bound=(len(bvh.escape) + len(bvh.order) + ends) * width * height, structure=bvh,
        defines=stack_defines(layout.stack_levels) if layout.stack_levels else {},
        stack_levels=layout.stack_levels, kept=kept, boxes=partial(layout.boxes, bvh),
        pointers=("node_count",),
        automatic=automatic_values(options))


def _family(layout_of: LayoutOf) -> dict[str, Any]:
    """Return the fields of a row that are functions. ``layout_of`` chooses the tables' layout."""
    def adopt(bvh: Bvh, triangles: np.ndarray, options: Options) -> Accelerator:
        kept = _Kept(layout_of(options)(bvh, options),
                     last_of_leaves(bvh.first, bvh.count, bvh.order))
        return _accelerator(bvh, kept, triangles, options)

    def prepare(triangles: np.ndarray, options: Options) -> Accelerator:
        check_culling(options)
        return adopt(_built(triangles, options), triangles, options)

    def refit(accelerator: Accelerator, triangles: np.ndarray, options: Options) -> Accelerator:
        kept: _Kept = accelerator.kept
        if kept.refitter is None:
            kept.refitter = Refitter.of(accelerator.structure)
        bvh = kept.refitter.refit(accelerator.structure, triangles)
        return _accelerator(bvh, kept, triangles, options)

    return {"prepare": prepare, "adopt": adopt, "refit": refit,
            "choose_tables": lambda options: (TRIANGLE, layout_of(options).record(options))}


_OCTANTS = Option("octants", False, "store eight copies of the tree, each threaded front to back "
                  "for a direction octant", bool, define="OCTANTS", label="copy per octant")
_SHARED = Option("shared_subtrees", None, "with octants: store a subtree of at most this many "
                 "nodes once for all eight copies; 64 halves the memory at 0.8 to 0.95 of the "
                 "speed", int,
                 minimum=3, maximum=EXACT_INTEGER, optional=True, tried=(64,),
                 define="SHARED_SUBTREES",
                 goes_with=("octants", (True,)), label="shared subtree size", unset=OFF)
_QUANTISE = Option("quantise_nodes", None, "bits per bound of a box, rounded outward: smaller "
                   "nodes with the same hits; default: no quantisation", int, choices=(8, 16),
                   optional=True, define="QUANTISED_NODES", label="bits per box bound", unset=OFF)
_INTERVAL_TEST = Option("interval_test", False, "test a box once for all rays of a packet, by "
                        "interval arithmetic", bool, define="INTERVAL_TEST",
                        label="test boxes by interval")
_STREAMS = Option("streams", False, "instead of packets, trace a stream of (ray, node) pairs; "
                  "each pass filters the stream; needs schedule=kernels", bool, excludes=(
                      "packet", "octants", "interval_test", "vertex_culling", "entry_points"),
                  label="streams, not packets")
_STREAM_SIZE = Option("stream_size", 1 << 15, "with streams: largest number of (ray, node) pairs "
                      "in a pass; with fewer pairs, the order in which a ray visits nodes is "
                      "closer to near-to-far order", int,
                      minimum=1, goes_with=("streams", (True,)), label="pairs per pass")
_REBUILD = Option("rebuild_ratio", REBUILD_RATIO, "rebuild the tree of moved triangles when the "
                  "SAH cost of the refitted tree is this many times the cost of the last build; "
                  "0: always rebuild", float, minimum=0, label="rebuild at cost ratio")

# GLSL files that options choose.
_SUBTREES = Part("subtrees", "shared_subtrees", "methods/bvh/own_subtrees.glsl",
                 {True: "methods/bvh/shared_subtrees.glsl"})
_ENTRIES = Part("entries", "entry_points", "methods/bvh/threaded_root.glsl",
                {True: "methods/bvh/threaded_entries.glsl"})
_PACKET_PARTS = (
    TRIANGLE_TESTS, CULLING, _SUBTREES,
    Part("box_tests", "interval_test", "drivers/boxes_by_ray.glsl",
         {True: "drivers/boxes_by_interval.glsl"}))
_STACK_PARTS = (*_PACKET_PARTS, Part("entry", "entry_points", "drivers/packet_root.glsl",
                                     {True: "methods/bvh/entry_stack.glsl"}))
_THREADS_PARTS = (*_PACKET_PARTS, Part("entry", "entry_points", "drivers/packet_root.glsl",
                                       {True: "methods/bvh/entry_threads.glsl"}))
_RAY = "methods/bvh/packet_ray.glsl"


def _stepwise(options: Options) -> Stepwise:
    """Return a packet's state, kernels and GLSL files for the schedule ``step``.

    With ``octants``, a packet goes along escape indices; otherwise, it has a stack.
    """
    if options.get("octants"):
        state = PACKET_SHARED_STATE if options.get("shared_subtrees") else PACKET_STATE
        return Stepwise(state, ("traverse", "intersect"),
                        "methods/bvh/packet_steps_threads.glsl", _RAY)
    return Stepwise(PACKET_STACK_STATE, ("traverse", "intersect", "push", "pop"),
                    "methods/bvh/packet_steps_stack.glsl", _RAY, STACK_ENTRY)


def _own_array(options: Options) -> bool:
    """Return whether fragments hold stacks in local arrays; under ``step``, textures hold them."""
    return (options["schedule"] == "loop"
            and not options.get("octants") and not options.get("streams"))


def _stack_row(name: str, summary: str, **more: Any) -> Method:
    """Return a row of Günther's method. ``state`` is a ray's record; ``packet_state`` returns a
    packet's."""
    return Method(
        name=name, summary=summary, citation="Günther et al. 2007",
        glsl=f"methods/bvh/{name.replace('-', '_')}.glsl", kernels=("step_packet",),
        parts=_STACK_PARTS, state=STATE, tables=(TRIANGLE, BVH_PAIR),
        schedules=("step", "loop"), drivers={
            "step": PacketSteps, "loop": PacketTraversal},
        packet_state=_stepwise, single="bvh-threaded", stack=True, own_array=_own_array,
        **more)


def _threaded_form(row: Method, options: Options) -> Method:
    """Return the row, with additional fields of the state for entry points or shared subtrees."""
    row = with_entries(BVH_ENTERING)(row, options)
    if not options["shared_subtrees"]:
        return row
    reason = ("a portal's reference to a shared subtree is a single number, and fp24 cannot hold "
              "such numbers of a large tree"
              if options.get("era") in TEXEL_POINTERS else "")
    return replace(row, state=row.state.extended(SHARED_WAY_OUT), no_era_form=reason)


def _packet_form(packets: Method, options: Options) -> Method:
    """Return the row of bvh-packet, adapted to these options.

    With ``streams``, passes filter a stream of (ray, node) pairs. With ``octants``, packets go
    along escape indices. Otherwise, packets have a stack.
    """
    if options["streams"]:
        return replace(packets, schedules=("kernels",), drivers={
            "kernels": RayStreams})
    if options["octants"]:
        return replace(packets, glsl="methods/bvh/bvh_packet_threads.glsl", parts=_THREADS_PARTS,
                       entry_walk="methods/bvh/packet_entry_threads.glsl")
    return replace(packets, entry_walk="methods/bvh/packet_entry_pairs.glsl")


FAMILY = "BVH"
ROWS = (
    Method(
        name="bvh-threaded",
        summary="traverses a BVH in depth-first order by escape indices, without a stack",
        citation="Thrane and Simonsen 2005",
        glsl="methods/bvh/bvh_threaded.glsl", parts=(_SUBTREES, _ENTRIES),
        kernels=("traverse", "intersect"),
        state=TREE_STATE,
        tables=(TRIANGLE, BVH_NODE),
        options=(*BUILD_OPTIONS, _OCTANTS, _SHARED, _QUANTISE, ENTRY_POINTS, _REBUILD),
        entry_walk="methods/bvh/entry_bvh.glsl", form=_threaded_form,
        **_family(lambda options: Threads)),
    _stack_row(
        "bvh-stack", "traverses a BVH with a stack per ray, the nearer child first",
        options=(*BUILD_OPTIONS, _QUANTISE, _REBUILD), **_family(lambda options: Pairs)),
    _stack_row(
        "bvh-packet", "traverses a BVH by packets with a shared stack; a packet first visits "
        "the child that is nearer for most of its rays",
        options=(*BUILD_OPTIONS, PACKET, _OCTANTS, _SHARED, _QUANTISE,
                 _INTERVAL_TEST, VERTEX_CULLING, PACKET_ENTRIES, _STREAMS, _STREAM_SIZE, _REBUILD),
        packet=True,
        form=_packet_form,
        **_family(lambda options: Threads if options["octants"] else Pairs)),
)
