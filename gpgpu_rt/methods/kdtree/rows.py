"""The kd-tree family: rows of the method table for methods that traverse the same tree."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...gl.record import Record
from ...options import Option
from ...traversal.era_packet_form import EraPackets
from ...traversal.leaf_lists import is_marked, leaf_tables
from ...traversal.method import (
    CULLING, ENTRY_POINTS, LEAF_LIST, PACKET, SCHEDULES, TRIANGLE_TESTS, VERTEX_CULLING,
    Accelerator, Method, Part, Stepwise, check_culling, stack_defines, with_entries
)
from ...traversal.packet_steps import PacketSteps
from ...traversal.packets import PacketTraversal
from ...traversal.records import ENTRIES, KD_ENTERING, STACK_ENTRY, STATE
from ...traversal.triangle_table import REFERENCE, TRIANGLE, triangle_table
from .builders import BUILD_OPTIONS, automatic_values, built_kdtree
from .records import (
    KD_BOUNDS, KD_LEAF, KD_NODE, KD_PACKET_ERA_STATE, KD_PACKET_RAY_STATE,
    KD_PACKET_STACK_RAY_STATE, KD_PACKET_STACK_STATE, KD_PACKET_STATE, KD_PUSH_DOWN_STATE,
    KD_ROPES_PACKET_RAY_STATE, KD_ROPES_PACKET_STATE, KD_SHORT_STACK_ERA_STATE,
    KD_SHORT_STACK_STATE, KD_STATE, KD_TEXTURE_STACK_STATE
)
from .ropes import build_ropes
from .tree import LEAF as KD_LEAF_AXIS

_OPEN = np.float32(3e38)
_TABLES = (TRIANGLE, KD_NODE, REFERENCE)

_NOT_EXACT = ("strict", "nudge-relative", "nudge-absolute")
_OPTIONS = (*BUILD_OPTIONS, Option(
    "interval", "exact", "start of a ray's next interval after a leaf: exact is the end of the "
    "last interval; the other choices imitate other implementations and may lose hits",
    choices=("exact", *_NOT_EXACT), relaxed=_NOT_EXACT, label="start after a leaf"))
_PUSH_DOWN = Option("push_down", True, "restart at the last node that contains the whole rest of "
                    "the interval, instead of the root", bool, define="PUSH_DOWN",
                    label="restart below the root")
_SKIP_EMPTY_LEAVES = Option("skip_empty_leaves", True, "skip leaves without triangles; an "
                            "inner node marks which of its children are empty leaves", bool,
                            define="SKIP_EMPTY_LEAVES")
_PARTS = (
    LEAF_LIST,
    Part("entries", "entry_points", "methods/kdtree/kd_root.glsl",
         {True: "methods/kdtree/kd_entries.glsl"}),
    Part("interval", "interval", "methods/kdtree/interval_exact.glsl", {
        word: f"methods/kdtree/interval_{word.replace('-', '_')}.glsl" for word in _NOT_EXACT}))
_SHORT_STACK = (Part("short_stack", "stack_size", "methods/kdtree/packet_short_stack.glsl",
                     {0: "methods/kdtree/packet_restart.glsl"}),
                Part("stack_steps", "stack_size", "methods/kdtree/packet_short_stack_steps.glsl",
                     {0: "methods/kdtree/packet_restart_steps.glsl"}))
_PACKET_STACK = Option("stack_size", 3, "number of stack entries; 0: only restarts", int,
                       choices=(0, 1, 2, 3, 4), define="STACK_SIZE", label="stack entries")
SIBLINGS, PUSHED = "siblings", "pushed"


def _ropes(default: str) -> Option:
    return Option(
        "ropes", default, "target of a leaf's ropes: the root of the sibling subtree, where the "
        "rays of a packet meet again, or the smallest node that contains the whole face",
        choices=(SIBLINGS, PUSHED), label="ropes lead to")


_FULL_STACK = Option("stack_size", None, "number of stack entries; default: the depth of the "
                     "tree, which always suffices", int, minimum=1, label="stack entries")


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    """Return the tables, uniforms and step bound that every method of the family needs."""
    check_culling(options)
    tree = built_kdtree(triangles, options)
    leaf = tree.axis == KD_LEAF_AXIS
    empty = np.append(leaf & (tree.count == 0), False)
    child = np.where(leaf, 0, tree.left)
    count = np.where(leaf, tree.count, empty[child] + 2 * empty[child + 1])
    fields = {"split": tree.split, "left": tree.left, "count": count,
              "axis": np.where(leaf, 3 + np.cumsum(leaf) - 1, tree.axis)}
    tables = {**triangle_table(triangles),
              **leaf_tables(KD_NODE, fields, "left", leaf, tree.references, options)}
    uniforms = {"scene_lo": tuple(tree.lo), "scene_hi": tuple(tree.hi)}
    # A ray enters each leaf at most once; between two leaves, it climbs at most to the root and
    # descends.
    bound = int(leaf.sum()) * (2 * tree.depth + 3) + len(tree.references)
    return Accelerator(tables, uniforms, bound, tree, boxes=tree.boxes,
                       automatic=automatic_values(triangles, options))


def _prepare_bounds(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    prepared = _prepare(triangles, options)
    lo, hi = prepared.structure.boxes()
    prepared.tables[KD_BOUNDS.name] = {"lo": lo, "hi": hi,
                                       "parent": prepared.structure.parents()}
    return prepared


def _with_boxes(prepare: Callable[..., Accelerator]) -> Callable[..., Accelerator]:
    """Return a ``prepare`` that adds the boxes of all nodes if ``entry_points`` is given.

    Faces on the scene's box are moved to infinity, where their rounding errors cannot lose a hit;
    the scene's box clips the rays anyway.
    """
    def prepare_boxes(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
        prepared = prepare(triangles, options)
        if options["entry_points"]:
            tree = prepared.structure
            lo, hi = tree.boxes()
            prepared.tables[KD_BOUNDS.name] = {"lo": np.where(lo <= tree.lo, -_OPEN, lo),
                                               "hi": np.where(hi >= tree.hi, _OPEN, hi)}
            prepared.step_bound += ENTRIES + 1
        return prepared
    return prepare_boxes


def _prepare_stack(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    prepared = _prepare(triangles, options)
    asked, depth = options["stack_size"], max(1, prepared.structure.depth)
    prepared.stack_levels = asked or depth
    prepared.automatic = {**prepared.automatic, "stack_size": depth}
    prepared.defines = {"STACK_SIZE": asked} if asked else stack_defines(depth)
    # A ray pushes and pops each node below the root at most once.
    prepared.step_bound += 2 * len(prepared.structure.axis)
    return prepared


def _prepare_ropes(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    prepared = _prepare(triangles, options)
    ropes = build_ropes(prepared.structure, options["ropes"] == PUSHED)
    fields = {"lo": ropes.lo, "hi": ropes.hi}
    for axis, letter in enumerate("xyz"):
        fields["rope_lo_" + letter] = ropes.rope_lo[:, axis]
        fields["rope_hi_" + letter] = ropes.rope_hi[:, axis]
    prepared.tables[KD_LEAF.name], prepared.numbered = fields, len(ropes.lo)
    return prepared


def _for_packets(prepared: Accelerator, options: Mapping[str, Any]) -> Accelerator:
    """Raise the step bound: a packet needs at most the sum of the steps of its rays."""
    prepared.step_bound *= options["packet"][0] * options["packet"][1]
    return prepared


def _changed_by_packets(options: Mapping[str, Any]) -> dict[str, str]:
    """Return the fields of KD_PACKET_ERA_STATE that each kernel computes.

    Fields that a kernel only sets to a constant are left out, and so is ``t_far``, a copy of
    ``t_max`` (glsl/methods/kdtree/kd_packet_era.glsl).
    """
    marks = options["push_down"] or options["stack_size"]
    found = {
        "traverse": "t_max:vec4 | place:int end:int phase:int"
                    + (" pushed:int" if options["push_down"] else "")
                    + (" | node_0:int" if marks else "")
                    + (" far:int" if options["stack_size"] else ""),
        "intersect": "place:int", "leave": "t_min:vec4 | phase:int",
        "begin": "t_min:vec4 | t_max:vec4 | t_turn:vec4 | negative:ivec3",
        "pop": "t_max:vec4 | place:int phase:int"}
    if options["stack_size"]:
        stack = "t_max_0:vec4 | t_max_1:vec4"
        found["pop"] += f" node_0:int node_1:int | {stack}"
        found["push"] = f"node_0:int node_1:int node_2:int | {stack} | t_max_2:vec4"
    return found


_ERA_PACKETS = EraPackets(
    "methods/kdtree/kd_packet_era.glsl", KD_PACKET_ERA_STATE, _changed_by_packets,
    {"packet": ((2, 2),), "skip_empty_leaves": (False,), "vertex_culling": (False,),
     "stack_size": (3, 0)})


def _packet_states(options: Mapping[str, Any]) -> tuple[Record, Record]:
    if options.get(_PACKET_STACK.name, _PACKET_STACK.default):
        return KD_PACKET_STACK_STATE, KD_PACKET_STACK_RAY_STATE
    return KD_PACKET_STATE, KD_PACKET_RAY_STATE


def _packet_row(name: str, summary: str, citation: str, single: str,
                states: Callable[[Mapping[str, Any]], tuple[Record, Record]],
                **more: Any) -> Method:
    """Return the row of a packet method.

    ``states`` returns a packet's and a ray's state under the schedule ``step``. Under ``loop``, a
    packet's state is in registers, and the row's ``state`` holds only each ray's final phase.
    """
    glsl = f"methods/kdtree/{name.replace('-', '_')}"

    def form(row: Method, options: Mapping[str, Any]) -> Method:
        stepwise = options.get("schedule") == "step"
        return replace(row, state=states(options)[1]) if stepwise else row

    return Method(
        name=name, summary=summary, citation=citation,
        glsl=f"{glsl}.glsl", kernels=("step_packet",),
        state=STATE, schedules=("step", "loop"),
        drivers={"step": PacketSteps, "loop": PacketTraversal}, form=form,
        packet_state=lambda options: Stepwise(
            states(options)[0], ("traverse", "intersect", "leave", "begin"),
            f"{glsl}_steps.glsl", "methods/kdtree/packet_ray.glsl"),
        packet=True, single=single, **more)


def _row(name: str, summary: str, citation: str, kernels: tuple[str, ...] = (),
         state: Record = KD_STATE, tables: tuple[Record, ...] = (),
         options: tuple[Option, ...] = (),
         prepare: Callable[..., Accelerator] = _prepare, **more: Any) -> Method:
    return Method(
        name=name, summary=summary, citation=citation,
        glsl=f"methods/kdtree/{name.replace('-', '_')}.glsl",
        kernels=("down", "intersect", *kernels),
        state=state, tables=(*_TABLES, *tables), prepare=prepare,
        options=(*_OPTIONS, *options), parts=_PARTS, **more)


def _short_stack(row: Method, options: Mapping[str, Any]) -> Method:
    """Return the row of kd-short-stack. With at most three stack entries, its era form
    (docs/era.md) with fp32 has a smaller state, which fits into a card's render targets."""
    if options.get("era") and not is_marked(options) and options["stack_size"] <= 3:
        return replace(row, state=KD_SHORT_STACK_ERA_STATE,
                       glsl="methods/kdtree/kd_short_stack_era.glsl")
    return with_entries(KD_ENTERING)(row, options)


def _entering_row(name: str, summary: str, citation: str, state: Record = KD_STATE,
                  options: tuple[Option, ...] = (),
                  prepare: Callable[..., Accelerator] = _prepare, **more: Any) -> Method:
    """Return the row of a method with the option ``entry_points``."""
    return _row(name, summary, citation, state=state, options=(*options, ENTRY_POINTS),
                prepare=_with_boxes(prepare), entry_walk="methods/kdtree/entry_kd.glsl",
                choose_tables=lambda options: (
                    (*_TABLES, KD_BOUNDS) if options["entry_points"] else _TABLES),
                **{"form": with_entries(KD_ENTERING), **more})


FAMILY = "kd-tree"
ROWS = (
    _entering_row("kd-restart", "traverses a kd-tree and restarts at the root after each leaf",
                  "Foley and Sugerman 2005", restarts=True),
    _row("kd-backtrack", "traverses a kd-tree and climbs the parents after each leaf",
         "Foley and Sugerman 2005", ("climb",), tables=(KD_BOUNDS,), prepare=_prepare_bounds),
    _entering_row("kd-push-down",
                  "restarts as kd-restart, but at the last node that contains the rest of the "
                  "ray's interval", "Horn et al. 2007", state=KD_PUSH_DOWN_STATE, restarts=True),
    _entering_row(
        "kd-short-stack", "works as kd-push-down, with a stack of a few far children",
        "Horn et al. 2007", state=KD_SHORT_STACK_STATE,
        options=(Option("stack_size", 3, "number of stack entries", int, choices=(1, 2, 3, 4),
                        define="STACK_SIZE",
                        label="stack entries"), _PUSH_DOWN), form=_short_stack, stack=True,
        restarts=True),
    _entering_row("kd-stack", "traverses a kd-tree with a full stack per ray, in a local array",
                  "Budge et al. 2008", options=(_FULL_STACK,), prepare=_prepare_stack,
                  schedules=("loop",), stack=True, own_array=lambda options: True),
    _row("kd-texture-stack", "traverses a kd-tree with a full stack per ray, in the tiles of a "
         "texture", "Ernst et al. 2004", ("push", "pop"), state=KD_TEXTURE_STACK_STATE,
         options=(_FULL_STACK,), prepare=_prepare_stack, stack_entry=STACK_ENTRY,
         schedules=tuple(s for s in SCHEDULES if s != "loop"), stack=True),
    _row("kd-ropes", "traverses a kd-tree from leaf to leaf along ropes", "Popov et al. 2007",
         ("follow_rope",), tables=(KD_LEAF,), options=(_ropes(PUSHED),), prepare=_prepare_ropes),
    _packet_row("kd-packet", "traverses a kd-tree by packets, with push-down and a short stack",
                "Horn et al. 2007", "kd-short-stack", tables=_TABLES,
                prepare=lambda triangles, options: _for_packets(_prepare(triangles, options),
                                                                options),
                options=(*BUILD_OPTIONS, PACKET, VERTEX_CULLING, _PUSH_DOWN, _PACKET_STACK,
                         _SKIP_EMPTY_LEAVES),
                parts=(TRIANGLE_TESTS, CULLING, *_SHORT_STACK), stack=True,
                states=_packet_states, era_packets=_ERA_PACKETS),
    _packet_row("kd-ropes-packet", "traverses a kd-tree by packets along ropes; the rays meet "
                "again at sibling subtrees",
                "Popov et al. 2007", "kd-ropes", tables=(*_TABLES, KD_LEAF),
                prepare=lambda triangles, options: _for_packets(
                    _prepare_ropes(triangles, options), options),
                options=(*BUILD_OPTIONS, PACKET, _ropes(SIBLINGS)), parts=(TRIANGLE_TESTS,),
                states=lambda options: (KD_ROPES_PACKET_STATE, KD_ROPES_PACKET_RAY_STATE)),
)
