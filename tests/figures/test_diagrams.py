"""Tests of the diagrams of the survey's figures. If a diagram draws the walk of a traced ray, a
test computes the same walk from geometry alone."""
from __future__ import annotations

import csv
import re

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.figures.diagrams.small_bvh import Hierarchy, hierarchy
from gpgpu_rt.figures.diagrams.small_world import MAX_DEPTH, Walk, World, walk, world
from gpgpu_rt.figures.framework.catalogue import FIGURES
from gpgpu_rt.figures.survey import fig03_stream_processing as fig03
from gpgpu_rt.figures.survey import fig04_ray_engine as fig04
from gpgpu_rt.figures.survey import fig09_kdtree as fig09
from gpgpu_rt.figures.survey import fig10_kdtree_traversal as fig10
from gpgpu_rt.figures.survey import fig11_restart_and_backtrack as fig11
from gpgpu_rt.figures.survey import fig15_ropes as fig15
from gpgpu_rt.figures.survey import fig18_bvh as fig18
from gpgpu_rt.figures.survey import fig19_threaded_bvh as fig19
from gpgpu_rt.figures.survey import fig21_geometry_image as fig21
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.kdtree.build import build_kdtree

DIAGRAMS = {"fig03": fig03, "fig04": fig04, "fig09": fig09, "fig10": fig10, "fig11": fig11,
            "fig15": fig15, "fig18": fig18, "fig19": fig19, "fig21": fig21}
SMALL = world()


def crossed(small: World) -> list[int]:
    """Returns the leaves that the ray crosses before its hit, in order, by float64 slab tests."""
    origin, direction = small.origin.astype(float), small.direction.astype(float)
    with np.errstate(divide="ignore"):
        t0, t1 = (small.lo - origin) / direction, (small.hi - origin) / direction
    enter = np.maximum(np.minimum(t0, t1)[:, :2].max(axis=1), 0)
    leave = np.maximum(t0, t1)[:, :2].min(axis=1)
    hit = rt.reference.trace(small.scene, small.origin[None], small.direction[None])
    leaves = [node for node in np.flatnonzero(enter < np.minimum(leave, hit.t[0]))
              if small.is_leaf(node)]
    return sorted(map(int, leaves), key=lambda node: enter[node])


def path(small: World, top: int, node: int) -> list[int]:
    """Returns the nodes from ``top`` down to ``node``, including both."""
    way = [node]
    while way[-1] != top:
        way.append(int(small.parents[way[-1]]))
    return way[::-1]


def common(small: World, one: int, two: int) -> int:
    """Returns the lowest common ancestor of two nodes."""
    above = set(path(small, 0, one))
    return next(node for node in path(small, 0, two)[::-1] if node in above)


def expected(small: World, method: str) -> list[int]:
    """Returns the nodes in the order in which a method must visit them."""
    leaves = crossed(small)
    visits = path(small, 0, leaves[0])
    for last, leaf in zip(leaves, leaves[1:]):
        meet = common(small, last, leaf)
        if method == "kd-restart":
            visits += path(small, 0, leaf)
        elif method == "kd-backtrack":
            visits += path(small, meet, last)[-2::-1] + path(small, meet, leaf)
        else:  # with a stack, the walk continues below `meet`
            visits += path(small, meet, leaf)[1:]
    return visits


def test_the_scene_of_the_diagrams() -> None:
    """The tree has the depth MAX_DEPTH and no split along z, and the ray crosses four leaves with
    triangles. A build gives the same tree again."""
    tree = SMALL.tree
    assert 2 not in tree.axis and tree.depth == MAX_DEPTH
    assert len(crossed(SMALL)) == 4 and all(SMALL.inside(leaf) for leaf in crossed(SMALL))
    assert 0.5 <= np.abs(SMALL.direction).max() < 1
    again = build_kdtree(SMALL.triangles, max_depth=MAX_DEPTH)
    assert all(np.array_equal(getattr(again, name), getattr(tree, name))
               for name in ("axis", "split", "left", "count", "references"))


@pytest.mark.parametrize("method", ["kd-texture-stack", "kd-restart", "kd-backtrack"])
def test_walks_visit_the_nodes_that_geometry_predicts(method: str) -> None:
    found = walk(method)
    assert found.visited == expected(SMALL, method)
    assert len(found.visited) == found.hits.nodes_visited[0]
    truth = rt.reference.trace(SMALL.scene, SMALL.origin[None], SMALL.direction[None])
    assert found.hits.triangle[0] == truth.triangle[0] >= 0


@pytest.mark.parametrize("name", DIAGRAMS)
def test_diagrams_are_drawn(name: str, tmp_path) -> None:
    assert name in FIGURES and not DIAGRAMS[name].cells(True)
    DIAGRAMS[name].draw(tmp_path, tmp_path, False)
    assert (tmp_path / f"{name}.png").stat().st_size > 20_000
    assert (tmp_path / f"{name}.md").read_text().startswith("# Figure")
    with (tmp_path / f"{name}.csv").open() as file:
        assert len(list(csv.reader(file))) > 5


def test_figure_3_streams_are_those_of_the_linked_programs() -> None:
    row, passes = find_method(fig03.METHOD), fig03.passes()
    assert {one.kernel for one in passes} == {"init", *row.kernels}
    streams, tables = fig03.streams(row.name), fig03.tables(row.name)
    for one in passes:
        assert set(one.samples) <= set(streams) | set(tables)
        assert one.targets == tuple(fig03.written(row.name)) and one.source != one.target
    gathered = {one.kernel: set(one.samples) & set(tables) for one in passes}
    assert gathered == {"init": set(), "down": {"kd_node_table"},
                        "intersect": {"reference_table", "triangle_table"}}
    assert set().union(*gathered.values()) == set(tables)


def test_figure_4_passes_read_the_textures_of_the_pass_before() -> None:
    """In a batch, every pass reads the textures that the previous pass wrote. The passes of all
    batches are present."""
    passes, split, hits = fig04.passes()
    order = [one.name for one in passes]
    assert order == list(fig04.TITLES) * int(split["batches"]) and split["batches"] > 2
    for before, after in zip(passes, passes[1:]):
        if before.batch == after.batch:
            assert set(before.targets) <= set(after.samples)
            assert not set(after.targets) & set(after.samples)
    for name in ("KEEP_NEAREST", "KEEP_FIRST"):
        assert sum(one.quads for one in passes if one.name == name) == split["quads"]
    assert all("triangle_table" in one.samples for one in passes)
    with rt.Tracer(SMALL.scene, "brute-force") as tracer:
        expected = tracer.trace(*fig03.rays())
    assert (hits.triangle == expected.triangle).all() and hits.hit.any()


def test_figure_3_passes_are_all_steps_of_all_rays() -> None:
    count = fig03.SIDE ** 2
    with rt.Tracer(SMALL.scene, fig03.METHOD, max_depth=MAX_DEPTH, statistics=True) as tracer:
        hits = tracer.trace(*fig03.rays())
    done = {kernel: sum(one.rays for one in fig03.passes() if one.kernel == kernel)
            for kernel in ("init", "down", "intersect")}
    assert done == {"init": count, "down": hits.nodes_visited.sum(),
                    "intersect": hits.triangles_tested.sum()}


def test_figure_9_lists_the_tree() -> None:
    for node, (name, number, _, holds) in enumerate(fig09.rows(SMALL)):
        assert int(number) == node and name == SMALL.name(node)
        if SMALL.is_leaf(node):
            assert list(map(int, re.findall(r"\d+", holds))) == SMALL.inside(node)
        else:
            assert f"{SMALL.tree.split[node]:.4f}" in holds
    # Each leaf lists only triangles whose bounding boxes overlap the leaf. The leaves together
    # list all triangles.
    for node in filter(SMALL.is_leaf, range(len(SMALL.tree.axis))):
        lo, hi = (SMALL.triangles[:, :2, :2].min(1), SMALL.triangles[:, :2, :2].max(1))
        meets = ((lo < SMALL.hi[node, :2]) & (hi > SMALL.lo[node, :2])).all(axis=1)
        assert set(SMALL.inside(node)) <= set(np.flatnonzero(meets).tolist())
    assert set().union(*(SMALL.inside(n) for n in range(len(SMALL.tree.axis))
                         if SMALL.is_leaf(n))) == set(range(len(SMALL.triangles)))


def test_figure_10_shows_the_walk_and_the_printed_mistake() -> None:
    """The rows of Figure 10 are the steps of the walk. `printed_rule` lists the nodes at which the
    survey's printed rule chooses the wrong child."""
    found = walk(fig10.METHOD)
    rows = fig10.rows(SMALL, found)
    assert len(rows) == found.hits.steps[0]
    down = [row for row in rows if row[1] == "down"]
    assert [row[2] for row in down] == [SMALL.name(node) for node in found.visited]
    for row, step in zip(rows, found.steps):
        assert row[4:6] == [f"{step.after['t_min']:.3f}", f"{step.after['t_max']:.3f}"]
        # The state gives the number of entries in the row's stack.
        assert row[7].count("(") == step.after["stacked"]
    for before, row in zip(rows, rows[1:]):
        if row[1] == "pop":     # a pop removes the top entry
            top = re.findall(r"\((\w+), ([\d.]+)\)", before[7])[-1]
            assert top == (row[2], row[5])
    assert re.search(r"triangle (\d+)", rows[-1][6])[1] == str(found.hits.triangle[0])
    start = found.steps[0].before
    printed = fig10.printed_rule(SMALL, start["t_min"], start["t_max"])
    behind = [node for node in found.visited
              if not SMALL.is_leaf(node) and SMALL.plane_t(node) < 0]
    assert printed.wrong == behind and printed.hit == -1
    assert not set(printed.visited) >= set(found.visited)


def test_the_printed_rule_is_right_where_no_plane_lies_behind(monkeypatch) -> None:
    """This ray starts outside the box, and no split plane of a visited node has a negative t. The
    printed rule of the survey's Figure 10 then agrees with the corrected rule."""
    outside = World(SMALL.scene, SMALL.triangles, SMALL.tree, SMALL.lo, SMALL.hi,
                    (SMALL.origin - SMALL.direction).astype(np.float32), SMALL.direction)
    found = walk(fig10.METHOD, outside)
    start = found.steps[0].before
    printed = fig10.printed_rule(outside, start["t_min"], start["t_max"])
    assert printed.visited == found.visited and not printed.wrong
    assert printed.hit == found.hits.triangle[0]


@pytest.mark.parametrize("method", fig11.METHODS)
def test_figure_11_numbers_every_visit(method: str) -> None:
    found = walk(method)
    turns = fig11.turns(found)
    assert sorted(turn for numbers in turns.values() for turn in numbers) == list(
        range(1, found.hits.nodes_visited[0] + 1))
    assert [row[3] for row in fig11.rows(SMALL, found)] == [
        SMALL.name(node) for node in expected(SMALL, method)]
    assert fig11.intervals(found) == fig11.intervals(walk(fig11.METHODS[0]))


def test_figure_15_follows_ropes_of_the_tree() -> None:
    """From each leaf but the last, the ray follows the rope of the face through which the ray
    leaves the leaf."""
    ropes, found = fig15.ropes_of(SMALL), walk(fig15.METHOD)
    taken, leaves = fig15.followed(found), crossed(SMALL)
    assert [rope.leaf for rope in taken] == leaves[:-1]
    for rope, leaf in zip(taken, leaves[1:]):
        faces = {face for (one, face), node in ropes.items()
                 if (one, node) == (rope.leaf, rope.node)}
        axis = int(np.argmin(np.abs(np.array([
            np.abs(SMALL.at(rope.t)[a] - np.array([SMALL.lo[leaf, a], SMALL.hi[leaf, a]])).min()
            for a in (0, 1)]))))
        ahead = int(SMALL.direction[axis] > 0)
        assert (("left", "right"), ("below", "above"))[axis][ahead] in faces
        assert leaf in subtree(SMALL, rope.node)
    visits = path(SMALL, 0, leaves[0])
    for rope, leaf in zip(taken, leaves[1:]):
        visits += path(SMALL, rope.node, leaf)
    assert found.visited == visits and len(visits) == found.hits.nodes_visited[0]


def test_figure_15_ropes_name_the_smallest_node() -> None:
    """A rope leads to the smallest node behind a leaf's face: the node touches the whole face, but
    neither of the node's children does."""
    for (leaf, face), node in fig15.ropes_of(SMALL).items():
        axis, upper = next((a, u) for name, a, u in fig15.FACES if name == face)
        other = 1 - axis
        lo, hi = SMALL.lo[leaf, other], SMALL.hi[leaf, other]

        def holds(candidate: int) -> bool:
            touches = (SMALL.lo[candidate, axis] == SMALL.hi[leaf, axis] if upper
                       else SMALL.hi[candidate, axis] == SMALL.lo[leaf, axis])
            return bool(touches and SMALL.lo[candidate, other] <= lo
                        and hi <= SMALL.hi[candidate, other])
        assert holds(node)
        left = int(SMALL.tree.left[node])
        assert SMALL.is_leaf(node) or not (holds(left) or holds(left + 1))


def subtree(small: World, top: int) -> set[int]:
    return {node for node in range(len(small.tree.axis)) if top in path(small, 0, node)}


def test_a_walk_has_one_ray() -> None:
    assert all(isinstance(walk(name), Walk) and len(walk(name).hits) == 1 for name in
               (fig10.METHOD, *fig11.METHODS, fig15.METHOD))


def below(found: Hierarchy, node: int) -> list[int]:
    """Returns the triangles below a node, by descending through its children."""
    if found.is_leaf(node):
        return found.inside(node)
    return [t for child in found.children(node) for t in below(found, child)]


def test_figure_18_boxes_are_the_smallest_around_their_triangles() -> None:
    found = hierarchy()
    assert sorted(below(found, 0)) == list(range(len(SMALL.triangles)))
    assert sum(map(found.is_leaf, range(len(found)))) > 2
    for node, (name, _, box, holds) in enumerate(fig18.rows(found)):
        inside = SMALL.triangles[below(found, node)]
        assert np.array_equal(found.bvh.lo[node], inside.min((0, 1)))
        assert np.array_equal(found.bvh.hi[node], inside.max((0, 1)))
        numbers = list(map(int, re.findall(r"\d+", holds)))
        assert int(name) == node
        assert numbers == (found.inside(node) if found.is_leaf(node)
                           else list(found.children(node)))
        assert f"({inside[..., 0].min():.3f}, {inside[..., 1].min():.3f})" in box


def test_figure_19_miss_links_lead_past_the_subtree() -> None:
    found = hierarchy()
    expected: dict[int, int | None] = {0: None}
    for node in range(len(found)):
        if not found.is_leaf(node):
            left, right = found.children(node)
            assert left == node + 1 == found.hit_link(node)
            expected[left], expected[right] = right, expected[node]
    assert expected == {node: found.miss_link(node) for node in range(len(found))}
    words = {str(node): "end" if link is None else str(link) for node, link in expected.items()}
    assert words == {row[0]: row[2] for row in fig19.rows(found, [])}


def test_figure_19_visits_the_nodes_that_geometry_predicts() -> None:
    """The visited nodes are the nodes that geometry predicts. The prediction follows hit links
    and miss links. It tests boxes by slabs in float64, and triangles by the float64 reference."""
    found, ray = hierarchy(), walk(fig19.METHOD)
    origin, direction = SMALL.origin.astype(float), SMALL.direction.astype(float)
    node, nearest, expected = 0, np.inf, []
    while node is not None:
        lo, hi = found.bvh.lo[node].astype(float), found.bvh.hi[node].astype(float)
        with np.errstate(divide="ignore"):
            t0, t1 = (lo - origin) / direction, (hi - origin) / direction
        enter = max(np.minimum(t0, t1).max(), 0)
        met = bool(enter <= min(np.maximum(t0, t1).min(), nearest))
        expected.append(fig19.Visit(node, met))
        if met and found.is_leaf(node):
            corners = SMALL.triangles[found.inside(node)].reshape(-1, 3)
            alone = rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))
            hit = rt.reference.trace(alone, SMALL.origin[None], SMALL.direction[None])
            nearest = min(nearest, float(hit.t[0]))
        node = found.hit_link(node) if met and not found.is_leaf(node) else found.miss_link(node)
    assert fig19.visits(found, ray) == expected and len(expected) < len(found)
    assert {visit.entered for visit in expected} == {True, False}
    assert len(expected) == ray.hits.nodes_visited[0]
    assert nearest == pytest.approx(float(ray.hits.t[0]), rel=1e-5)


@pytest.mark.parametrize("height", range(7))
def test_figure_21_shows_the_least_and_greatest_positions(height: int) -> None:
    """Each level shows the minimum and maximum of each block of texels. The test computes both
    directly from the positions. A block shares its last row and its last column of texels with the
    next blocks."""
    tree, *found = fig21.pyramids()
    positions, side = fig21.image().charts[0], 2**height
    for boxes, reduce in zip(found, (np.min, np.max)):
        shown = fig21.level(tree, boxes, height)
        expected = [[reduce(positions[r:r + side + 1, c:c + side + 1], axis=(0, 1))
                     for c in range(0, fig21.SIZE, side)] for r in range(0, fig21.SIZE, side)]
        assert np.array_equal(shown, np.array(expected))


def test_figure_21_is_a_closed_mesh() -> None:
    scene, rays = fig21.image().scene(), np.random.default_rng(1).normal(size=(3000, 3))
    with rt.Tracer(scene, "geometry-image") as tracer:
        assert tracer.trace(np.zeros_like(rays), rays).hit.all()
    assert int(fig21.rows()[-1][1]) == 1 and fig21.rows()[0][1] == fig21.SIZE**2
