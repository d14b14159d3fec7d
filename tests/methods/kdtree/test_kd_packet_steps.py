"""Tests of packets in kd-trees under the schedule `step`. In one pass, the rays of a packet vote,
and the packet's new state is stored. In the next pass, each ray's new state is stored."""
from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.inspect.time_travel import Pass, phase_names, travel
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.kdtree.tree import LEAF
from gpgpu_rt.rays.records import HIT

# Variants of packet methods. The first three are restart, push-down and short stack, as in Horn et
# al. 2007, but they skip empty leaves. The next three have other sizes of stacks or packets; three
# more follow ropes. The last three visit empty leaves, as the packets of Horn et al. do.
FORMS: list[tuple[str, dict[str, Any]]] = [
    ("kd-packet", {"push_down": False, "stack_size": 0}),
    ("kd-packet", {"push_down": True, "stack_size": 0}),
    ("kd-packet", {}),
    ("kd-packet", {"push_down": False, "stack_size": 1, "packet": (2, 1)}),
    ("kd-packet", {"stack_size": 4, "packet": (4, 4)}),
    ("kd-packet", {"packet": (1, 1)}),
    ("kd-ropes-packet", {}),
    ("kd-ropes-packet", {"ropes": "pushed", "packet": (4, 2)}),
    ("kd-ropes-packet", {"packet": (4, 4)}),
    ("kd-packet", {"skip_empty_leaves": False}),
    ("kd-packet", {"skip_empty_leaves": False, "push_down": False, "stack_size": 0}),
    ("kd-packet", {"skip_empty_leaves": False, "stack_size": 1, "packet": (4, 4)})]
COUNTED = ("steps", "nodes_visited", "leaves_visited", "triangles_tested")
STEP = {"schedule": "step"}
TARGETS = 4     # the number of render targets of the R420 and the R580


def together(scene: rt.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return 45x45 eye rays and 45x45 random rays.

    A packet traces its rays in turns. One turn traces the rays whose directions have the same
    signs. The packets include packets of one turn, packets of many turns, and packets at the edge
    of the image.
    """
    sets = [RAY_SETS[rays](scene, 2025, 4) for rays in ("eye", "random")]
    return tuple(np.concatenate(both).reshape(90, 45, 3) for both in zip(*sets))


@pytest.mark.parametrize("intersection", ["woop-watertight", "plucker"])
@pytest.mark.parametrize("method, options", FORMS, ids=str)
def test_step_does_the_work_of_loop(precise_renderer, method: str, options: dict,
                                    intersection: str) -> None:
    """`step` and `loop` give the same hits, counters and steps for every ray. For any-hit queries,
    the answers and the sums of the counters are the same."""
    scene = soup_scene(300, 5)
    rays = together(scene)
    found = []
    for schedule in ({}, STEP):
        with rt.Tracer(scene, method, statistics=True, intersection=intersection, **schedule,
                       **options) as tracer:
            hits = tracer.trace(*rays)
            blocked = tracer.occluded(*rays, t_max=0.7)
            any_hit = tracer.statistics.counters
        found.append((hits, blocked, any_hit))
    (loop, *of_loop), (step, *of_step) = found
    assert_same_bits(step, loop)
    assert not step.status.any() and 0 < of_step[0].mean() < 1
    assert (of_step[0] == of_loop[0]).all() and of_step[1] == of_loop[1]
    for name in COUNTED:
        assert (getattr(step, name) == getattr(loop, name)).all(), name


@pytest.mark.parametrize("method", ["kd-packet", "kd-ropes-packet"])
@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (17, 4)], ids=str)
def test_packets_at_the_edges_of_odd_images(precise_renderer, method: str,
                                            shape: tuple[int, int]) -> None:
    """A packet at the edge has lanes beyond the edge, which read the texel of another ray. These
    lanes change no vote."""
    scene = soup_scene(100, 3)
    rays = RAY_SETS["random"](scene, shape[0] * shape[1], 5)
    found = []
    for schedule in ({}, STEP):
        with rt.Tracer(scene, method, packet=(4, 4), statistics=True, **schedule) as tracer:
            found.append(tracer.trace(*rays, shape=shape))
    assert_same_bits(*found)
    assert (found[0].nodes_visited == found[1].nodes_visited).all()


@pytest.mark.parametrize("method, options", FORMS, ids=str)
def test_states_fit_the_targets_of_the_papers_cards(method: str, options: dict) -> None:
    """A packet's state needs at most TARGETS render targets. So does a ray's state together with
    the ray's hit."""
    row = find_method(method)
    packet = row.packet_state(row.resolved({**STEP, **options})).state
    ray = row.formed({**STEP, **options}).state
    assert packet.texels <= TARGETS and ray.texels + HIT.texels <= TARGETS


@pytest.mark.parametrize("method, options", [FORMS[0], FORMS[2], FORMS[6]], ids=str)
def test_time_travel_shows_packets_and_their_rays(method: str, options: dict) -> None:
    """Each recorded pass has the fields of the packet's state and of the ray's state."""
    scene = soup_scene(150, 3)
    passes: list[Pass] = []
    with rt.Tracer(scene, method, **STEP, **options) as tracer:
        travel(tracer, *RAY_SETS["random"](scene, 150, 3), passes.append)
        names, depth = phase_names(tracer), tracer.accelerator.structure.depth
        state, = (row.packet_state(tracer.options).state for row in [find_method(method)])
    own = {field.name for field in tracer.method.state.fields}
    assert {field.name for field in state.fields} | own == set(passes[-1].state)
    served = set().union(*(one.served for one in passes))
    assert served == {"traverse", "intersect", "leave", "begin"} <= set(names.values())
    assert depth > 3 and passes[-1].live == 0 < passes[0].live
    t_min = np.array([one.state["t_min"] for one in passes])
    begun = np.array([one.served.get("begin", 0) for one in passes])
    # After the last turn has begun, no ray's t_min decreases.
    rest = t_min[begun.nonzero()[0][-1] + 2:]
    assert (rest[1:] >= rest[:-1]).all() and (rest[-1] > rest[0]).any()


@pytest.mark.parametrize("skips", [True, False], ids=str)
def test_a_packet_leaves_an_empty_leaf_at_once(skips: bool) -> None:
    """With `skip_empty_leaves`, no visit ends at an empty leaf. Without this option, the kernel
    `leave` follows such a visit, because an empty leaf has no triangle to intersect.

    Push-down is off. With push-down, the node at which a restart begins moves down the tree, and
    may become an empty leaf that the packet has passed. The next visit would end at this leaf.
    """
    scene = soup_scene(150, 3)
    passes: list[Pass] = []
    with rt.Tracer(scene, "kd-packet", push_down=False, skip_empty_leaves=skips,
                   **STEP) as tracer:
        travel(tracer, *RAY_SETS["random"](scene, 150, 3), passes.append)
        tree = tracer.accelerator.structure
    is_empty = (tree.axis == LEAF) & (tree.count == 0)
    states = [one.state for one in passes if one.kernel == "visit"]
    # last == 1: the kernel `traverse` ran last. phase == 3: the kernel `leave` runs next.
    phases = np.concatenate([state["phase"][(state["last"] == 1) & is_empty[state["from"]]]
                             for state in states])
    assert is_empty.any() and (len(phases) == 0) == skips and (phases == 3).all()


def stacked(one: Pass) -> np.ndarray:
    """Return the number of entries on each stack after a pass."""
    return (one.state["stack_node"] != 0).sum(axis=1)


def test_a_packet_pops_what_it_pushed() -> None:
    """The packet's state holds the nodes of the stack. The state of each ray holds the ends of the
    ray's intervals in these nodes."""
    scene = soup_scene(150, 3)
    passes: list[Pass] = []
    with rt.Tracer(scene, "kd-packet", stack_size=4, packet=(1, 1), **STEP) as tracer:
        assert tracer.method.stack_entry is None
        travel(tracer, *RAY_SETS["random"](scene, 150, 3), passes.append)
    visits = [one for one in passes if one.kernel == "visit"]
    for before, after in zip(visits, visits[1:]):
        popped = after.state["popped"]
        left = after.state["last"] == 3
        assert (stacked(after) == stacked(before) - popped)[left].all()
        top = np.take_along_axis(before.state["stack_node"],
                                 np.maximum(popped - 1, 0)[:, None], axis=1)[:, 0]
        on = left & (after.state["phase"] == 1) & (popped > 0) & (after.state["pushing"] == 0)
        assert (after.state["node"] == top)[on].all()
    rays = [one for one in passes if one.kernel == "intersect"]
    ends = np.array([one.state["stack_t_max"] for one in rays])
    depths = np.array([stacked(one) for one in rays])
    assert depths.max() == 4
    assert ((ends > 0) == (np.arange(4) < depths[..., None])).all()
    # Entry 0 is the newest. The interval of a newer entry ends earlier.
    assert ((ends[..., 1:] == 0) | (ends[..., 1:] >= ends[..., :-1])).all()
