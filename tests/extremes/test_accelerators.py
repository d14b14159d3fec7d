"""Tests nine of the rows 24 to 40 of the catalogue (`gpgpu_rt/conform/families.py`). These rows
are hard cases for kd-trees, grids, BVHs and step caps. Two tests read the traversal states after
each step."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, variants
from watching import Fields, watching

import gpgpu_rt as rt
from gpgpu_rt.accel.bounds import padding
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.conform.shapes import soup
from gpgpu_rt.conform.structure_families import long_way
from gpgpu_rt.gl.record import EXACT_INTEGER
from gpgpu_rt.methods import built_in_methods
from gpgpu_rt.methods.bvh.tree import Bvh
from gpgpu_rt.methods.geometry_image.tree import ImageTree
from gpgpu_rt.methods.grid.cells import Grid
from gpgpu_rt.methods.kdtree.tree import KdTree

ROWS = {row.name: row for row in rt.methods()}
# In a built-in method, the type of the structure determines the step bound and the state field
# that names a node or cell. A user's own method need not obey this rule.
BUILT_IN = {row.name: row for row in built_in_methods()}


def built_on(kind: type) -> list[str]:
    """Returns the built-in methods with an accelerator of the type ``kind``. Methods whose states
    cannot be read after each step are left out."""
    probe = make_case("one-triangle", 1, 0).scene
    names = []
    for name, row in BUILT_IN.items():
        if "step" not in row.schedules:
            continue
        with rt.Tracer(probe, name, schedule="step") as tracer:
            if isinstance(tracer.accelerator.structure, kind):
                names.append(name)
    return names


KD, GRID, BVH = (built_on(kind) for kind in (KdTree, Grid, Bvh))


# kd-trees ----------------------------------------------------------------------------------------

def plane_rays(tree: KdTree, n: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Returns rays that start on split planes. A third of the rays run exactly in their plane, and
    another third run almost in their plane."""
    inner = np.flatnonzero(tree.axis != 3)
    node = inner[rng.integers(len(inner), size=n)]
    origins = tree.lo + (tree.hi - tree.lo) * rng.random((n, 3)).astype(np.float32)
    directions = rng.normal(size=(n, 3))
    rows, axis = np.arange(n), tree.axis[node]
    origins[rows, axis] = tree.split[node]
    directions[rows[::3], axis[::3]] = rng.choice([0.0, -0.0], len(rows[::3]))
    directions[rows[1::3], axis[1::3]] = rng.choice([1e-30, -1e-30, 1e-7, -1e-7],
                                                    len(rows[1::3]))
    return origins.astype(np.float32), directions.astype(np.float32)


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("method", KD)
def test_rows_24_and_25_rays_from_split_planes(precise_renderer, method: str, seed: int) -> None:
    """The steps of rays that start on split planes are bounded, and the hits equal the hits of
    brute force."""
    case = make_case("spanning", 1, seed)
    with rt.Tracer(case.scene, method, statistics=True) as tracer:
        tree = tracer.accelerator.structure
        rays = plane_rays(tree, 3000, np.random.default_rng(seed))
        hits = tracer.trace(*rays)
    assert not hits.status.any()
    leaves = int((tree.axis == 3).sum())
    assert hits.leaves_visited.max() <= leaves
    # For each leaf, a ray walks at most from the root to the leaf and back. A triangle test is a
    # step, too, so subtract the tests. A packet also walks to empty leaves, but does not count
    # them as visited. For packets, the bound therefore uses the number of all leaves.
    walks = leaves if ROWS[method].packet else hits.leaves_visited
    assert (hits.steps - hits.triangles_tested <= walks * (2 * tree.depth + 2) + 1).all()
    with rt.Tracer(case.scene, "brute-force") as tracer:
        assert_same_bits(hits, tracer.trace(*rays))


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("method", KD)
def test_row_25_triangles_in_split_planes(precise_renderer, method: str, seed: int) -> None:
    """Hits on triangles that lie in split planes equal the hits of brute force.

    The test builds a tree and adds flat triangles in its split planes. A second tree contains the
    flat triangles too. Many split planes of the first tree are also split planes of the second.
    """
    rng = np.random.default_rng(seed)
    triangles = soup(400, seed, 0.05)
    with rt.Tracer(Case(triangles, [[0, 0, 0]], [[1, 0, 0]]).scene, method) as tracer:
        tree = tracer.accelerator.structure
    inner = np.flatnonzero(tree.axis != 3)[:60]
    flat = rng.random((len(inner), 1, 3)) + 0.1 * rng.normal(size=(len(inner), 3, 3))
    flat[np.arange(len(inner)), :, tree.axis[inner]] = tree.split[inner, None]
    case = Case(np.concatenate([triangles, flat.astype(np.float32)]), [[0, 0, 0]], [[1, 0, 0]])
    origins = (rng.random((2000, 3)) * 2 - 0.5).astype(np.float32)
    aims = case.triangles[400 + rng.integers(len(inner), size=2000)].mean(axis=1)
    answers = []
    for name in (method, "brute-force"):
        with rt.Tracer(case.scene, name) as tracer:
            answers.append(tracer.trace(origins, aims - origins))
    assert answers[1].triangle.max() >= 400
    assert_same_bits(*answers)


# Grids -------------------------------------------------------------------------------------------

def cells_crossed(grid: Grid, origins: np.ndarray, directions: np.ndarray, end: np.ndarray,
                  shortest: float) -> np.ndarray:
    """Returns a key (see `keys`) for each pair of a ray and a cell that the ray crosses. Pairs are
    left out if the ray's segment in the cell, in float64, is not longer than ``shortest``."""
    origins, directions = origins.astype(np.float64), directions.astype(np.float64)
    lo, size = grid.lo.astype(np.float64), grid.cell_size.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.concatenate([(lo[a] + size[a] * np.arange(grid.resolution[a] + 1)
                             - origins[:, a:a + 1]) / directions[:, a:a + 1]
                            for a in range(3)], axis=1)
    t = np.sort(np.clip(np.where(np.isfinite(t), t, 0), 0, end[:, None]), axis=1)
    middle = (t[:, 1:] + t[:, :-1]) / 2
    at = origins[:, None] + middle[..., None] * directions[:, None]
    cell = np.floor((at - lo) / size).astype(np.int64)
    length = (t[:, 1:] - t[:, :-1]) * np.linalg.norm(directions, axis=1)[:, None]
    inside = ((cell >= 0) & (cell < grid.resolution)).all(axis=2) & (length > shortest)
    return keys(grid, cell)[inside]


def keys(grid: Grid, cell: np.ndarray) -> np.ndarray:
    """Maps the cells of n rays, (n, ..., 3), to keys, (n, ...). Each ray has its own range of
    keys."""
    rx, ry, rz = (int(r) for r in grid.resolution)
    ray = np.arange(len(cell)).reshape(-1, *[1] * (cell.ndim - 2))
    return (ray * rz + cell[..., 2]) * rx * ry + cell[..., 1] * rx + cell[..., 0]


def cells_visited(tracer: rt.Tracer, origins: np.ndarray,
                  directions: np.ndarray) -> tuple[rt.Hits, np.ndarray]:
    seen = []

    def look(state: Fields, hit: Fields) -> None:
        seen.append(keys(tracer.accelerator.structure, state["cell"][:len(origins)]))
    with watching(tracer, look):
        hits = tracer.trace(origins, directions)
    return hits, np.unique(np.concatenate(seen))


@pytest.mark.parametrize("name, row, share", [("cell-corners", 28, 0.0), ("diagonals", 29, 0.017)],
                         ids=["row28", "row29"])
@pytest.mark.parametrize("method", [name for name in GRID if "proximity" not in name])
def test_grids_visit_the_exact_cells(method: str, name: str, row: int, share: float) -> None:
    """A grid visits the cells that a ray crosses, if the ray's segment in the cell is long enough.

    In row 28, the segment must be longer than twice the padding of boxes. In row 29, the segment
    must be longer than 1e-9, and up to 1.7 % of the rays may miss a cell.
    """
    case = make_case(name, 300, 5)
    with rt.Tracer(case.scene, method, schedule="step", **case.options[method]) as tracer:
        grid = tracer.accelerator.structure
        hits, visited = cells_visited(tracer, case.origins, case.directions)
    end = np.where(hits.hit, hits.t * (1 - 1e-6), 1e9).astype(np.float64)
    shortest = 2 * float(padding(case.triangles)) if row == 28 else 1e-9
    exact = cells_crossed(grid, case.origins, case.directions, end, shortest)
    assert len(exact) > 300
    missed = exact[~np.isin(exact, visited)] // int(np.prod(grid.resolution.astype(np.int64)))
    assert len(np.unique(missed)) <= share * 300, missed[:10]


# Bounding volume hierarchies ---------------------------------------------------------------------

@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
@pytest.mark.parametrize("far", [False, True], ids=["near", "moved-1e4"])
@pytest.mark.parametrize("method, options", [
    pytest.param(name, options, id="-".join([name, *map(str, options.values())]))
    for name in BVH if not ROWS[name].single  # no packets: their rays visit nodes together
    for options in variants(name) if set(options) <= {"quantise_nodes"}])
def test_rows_31_and_32_rays_visit_every_node_that_they_meet(method: str, options: dict, far: bool,
                                                             seed: int) -> None:
    """Rays aim at the corners of boxes. A float64 test finds the nodes whose boxes a ray meets
    before its hit, and the ray must visit all of these nodes. This also holds for quantised nodes,
    which store a wider box in few bits."""
    case = make_case("box-corners", 300, seed)
    if far:  # the moved corners are exact in float32
        step = np.float32(2.0**-9)
        case.triangles, case.origins = (np.round(a / step) * step + np.float32(10_000)
                                        for a in (case.triangles, case.origins))
        case.directions = case.triangles[np.arange(300) % 500, 0] - case.origins
    seen = []

    def look(state: Fields, hit: Fields) -> None:
        seen.append(state["node"][:300].copy())
    with (rt.Tracer(case.scene, method, schedule="step", **options) as tracer,
          watching(tracer, look)):
        bvh = tracer.accelerator.structure
        hits = tracer.trace(case.origins, case.directions)
    visited = np.zeros((300, len(bvh.escape) + 1), bool)
    for nodes in seen:
        visited[np.arange(300), nodes] = True  # node -1, the end of a walk, is the last column
    o, d = (a.astype(np.float64)[:, None] for a in (case.origins, case.directions))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = (bvh.lo - o) / d, (bvh.hi - o) / d
    enter = np.fmax.reduce(np.fmin(t0, t1), axis=2)
    leave = np.fmin.reduce(np.fmax(t0, t1), axis=2)
    until = np.where(hits.hit, hits.t.astype(np.float64) * (1 - 1e-6), np.inf)[:, None]
    meets = (np.fmax(enter, 0) <= leave) & (enter <= until)
    assert meets.sum() > 2000
    assert not (meets & ~visited[:, :-1]).any()


@pytest.mark.parametrize("build", ["sah", "kay-kajiya", "goldsmith-salmon"])
@pytest.mark.parametrize("method", BVH)
def test_row_34_the_deepest_trees(precise_renderer, method: str, build: str) -> None:
    """Very deep trees overflow no stack. Each triangle has 0.8 times the size of the previous
    triangle, so the boxes of the triangles are nested, and builders make deep trees."""
    size = 0.8 ** np.arange(120)[:, None, None]
    corner = np.float64([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    case = Case(corner * size, np.full((200, 3), 2.0), np.random.default_rng(1).normal(
        size=(200, 3)) * 0.05 - 1)
    options = {"build": build} if any(o.name == "build" and build in o.choices
                                      for o in ROWS[method].options) else {}
    with rt.Tracer(case.scene, method, **options) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert not hits.status.any(), "a stack overflowed"
    with rt.Tracer(case.scene, "brute-force") as tracer:
        assert_same_bits(hits, tracer.trace(case.origins, case.directions))


# Caps and loops ----------------------------------------------------------------------------------

def stated_cap(structure: object, triangles: int, stack: bool) -> int:
    """Returns the step bound that docs/extremes.md states for an accelerator, computed from the
    accelerator's depth and size."""
    if isinstance(structure, Grid):
        occupied = (np.diff(structure.cell_start) > 0).sum()
        return int(structure.resolution.sum() + len(structure.references) + occupied) + 3
    if isinstance(structure, KdTree):
        leaves = (structure.axis == 3).sum()
        visits = leaves * (2 * structure.depth + 3) + 2 * stack * len(structure.axis)
        return int(visits + len(structure.references))
    if isinstance(structure, Bvh):
        return len(structure.escape) + len(structure.order)
    if isinstance(structure, ImageTree):
        return len(structure.miss) + len(structure.corner)
    return triangles


@pytest.mark.parametrize("name", ["long-way", "in-planes", "box-corners"])
@pytest.mark.parametrize("method", ROWS)
def test_row_40_the_cap_follows_from_the_structure(method: str, name: str) -> None:
    """The step cap is one step more than the accelerator's bound, but at most EXACT_INTEGER - 1.
    No ray reaches the cap."""
    case = make_case(name, 200, 7) if name != "long-way" else long_way(300, 4, 7)
    with rt.Tracer(case.scene, method, statistics=True) as tracer:
        structure = tracer.accelerator.structure
        hits = tracer.trace(case.origins, case.directions)
        if method in BUILT_IN and (structure is None or type(structure) in (
                Grid, KdTree, Bvh, ImageTree)):
            one_ray = stated_cap(structure, len(case.triangles),
                                 method in ("kd-stack", "kd-texture-stack"))
            packet = np.prod(tracer.options.get("packet", 1))
            assert tracer.accelerator.step_bound == one_ray * packet
        assert tracer.step_cap == min(tracer.accelerator.step_bound + 1, EXACT_INTEGER - 1)
        assert not hits.status.any() and hits.steps.max() < tracer.step_cap


@pytest.mark.parametrize("method, schedule", [(name, schedule) for name, row in ROWS.items()
                                              for schedule in row.schedules])
def test_row_40_rays_at_the_cap_are_flagged(method: str, schedule: str) -> None:
    """With a cap of k steps, each ray either ends by step k or has status 2. No ray stops
    silently."""
    case = make_case("box-corners", 200, 8)
    case.triangles = case.triangles[:100]
    with rt.Tracer(case.scene, method, statistics=True) as tracer:
        whole = tracer.trace(case.origins, case.directions)
    for cap in (1, 7, int(np.median(whole.steps))):
        with rt.Tracer(case.scene, method, schedule=schedule, step_cap=cap) as tracer:
            hits = tracer.trace(case.origins, case.directions)
        flagged = hits.status == 2
        assert not flagged[whole.steps < cap].any()
        if ROWS[method].single:  # a ray may have its final hit before its packet stops
            assert (flagged | (hits.triangle == whole.triangle)).all()
        else:
            assert flagged[whole.steps > cap].all()


@pytest.mark.parametrize("method", [name for name, row in ROWS.items() if "loop" in row.schedules])
def test_row_36_more_iterations_than_a_loop_runs(method: str) -> None:
    """llvmpipe silently ends a loop after 65,535 iterations. Later passes then do the remaining
    steps."""
    case = long_way(70_000 if method == "brute-force" else 40_000, 3, 9)
    with rt.Tracer(case.scene, method, statistics=True) as tracer:
        hits = tracer.trace(case.origins, case.directions)
        passes = tracer.statistics.passes
    assert hits.hit.all() and not hits.status.any()
    assert (hits.triangle == len(case.triangles) - 1).all()
    assert passes > 1 or hits.steps.max() < 60_000
