"""Large scenes: tables are uploaded in slices, and trees keep their node numbers within float32's
exact integers. The full suite also checks the memory for scenes of millions of triangles."""
from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.accel import bounds
from gpgpu_rt.gl import textures
from gpgpu_rt.gl.record import EXACT_INTEGER
from gpgpu_rt.gl.textures import TABLE_WIDTH, read_texture, table_textures
from gpgpu_rt.methods.bvh import build as bvh
from gpgpu_rt.methods.bvh import rows as methods_bvh
from gpgpu_rt.methods.bvh.build import build_bvh, node_limit
from gpgpu_rt.methods.bvh.octant_copies import OctantCopies, times_stored
from gpgpu_rt.methods.kdtree import build as kdtree
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.tree import LEAF, LooseKdTree
from gpgpu_rt.scene import catalogue
from gpgpu_rt.traversal.triangle_table import TRIANGLE

BUILDS = ["sah", "kay-kajiya", "goldsmith-salmon"]


@pytest.mark.parametrize("count", [1, TABLE_WIDTH - 1, TABLE_WIDTH, 2 * TABLE_WIDTH + 5])
def test_slices_make_the_same_table(gpu, count: int, monkeypatch) -> None:
    rng = np.random.default_rng(1)
    fields = {"v0": rng.random((count, 3)), "v1": rng.random((count, 3)),
              "v2": rng.random((count, 3)), "index": rng.integers(0, EXACT_INTEGER, count),
              "last": rng.integers(0, 2, count)}
    expected = TRIANGLE.pack(**fields).reshape(-1, 4)
    for at_once in (TABLE_WIDTH, 2 * TABLE_WIDTH, textures.RECORDS_AT_ONCE):
        monkeypatch.setattr(textures, "RECORDS_AT_ONCE", at_once)
        table = table_textures(gpu, TRIANGLE, fields)["triangle_table"]
        texels = read_texture(table).reshape(-1, 4)
        assert (texels[:3 * count] == expected).all() and not texels[3 * count:].any()
        table.release()


def test_a_texture_is_reused_if_the_table_fits(gpu) -> None:
    """A table is written into the given texture if it fits, and else into a new texture."""
    corners = {f"v{k}": np.full((10, 3), k) for k in range(3)}
    first = table_textures(gpu, TRIANGLE, {**corners, "index": np.arange(10)})
    again = table_textures(gpu, TRIANGLE, {**corners, "index": np.arange(10) + 5}, into=first)
    assert again["triangle_table"].glo == first["triangle_table"].glo
    assert read_texture(again["triangle_table"])[0, 0, 3] == 5
    many = {name: np.repeat(rows, 900, axis=0) for name, rows in corners.items()}
    larger = table_textures(gpu, TRIANGLE, {**many, "index": np.arange(9000)}, into=again)
    assert larger["triangle_table"].height == 7
    larger["triangle_table"].release()


@pytest.mark.parametrize("most", [1, 2, 3, 40, 333, 10**6])
@pytest.mark.parametrize("build", BUILDS)
def test_coarsened_trees(build: str, most: int) -> None:
    """A BVH with a node limit keeps all triangles, and its boxes contain the triangles."""
    triangles = random_soup(500, 3)
    fine, tree = (build_bvh(triangles, build=build, most_nodes=m) for m in (None, most))
    assert len(tree.escape) <= most
    assert most > len(fine.escape) or len(tree.escape) > most / 5
    assert np.array_equal(np.sort(tree.order), np.arange(500))
    nodes, leaf = np.arange(len(tree.escape)), tree.count > 0
    assert (tree.escape[leaf] == nodes[leaf] + 1).all() and tree.escape[0] == len(nodes)
    assert np.array_equal(tree.first[leaf], np.cumsum(tree.count[leaf]) - tree.count[leaf])
    owner = np.repeat(nodes[leaf], tree.count[leaf])
    assert not ((np.diff(tree.order) < 0) & (np.diff(owner) == 0)).any()
    inside = triangles[tree.order]
    assert (inside.min(axis=(0, 1)) == tree.lo[0]).all()
    assert (inside >= tree.lo[owner, None]).all() and (inside <= tree.hi[owner, None]).all()
    if most > len(fine.escape):
        assert np.array_equal(tree.escape, fine.escape) and np.array_equal(tree.order, fine.order)


@pytest.mark.parametrize("method, options, limit", [
    ("bvh-threaded", {}, 300), ("bvh-threaded", {"octants": True}, 300),
    ("bvh-threaded", {"build": "kay-kajiya"}, 300),
    ("bvh-threaded", {"octants": True, "quantise_nodes": 16}, 300),
    *((method, {"octants": True, "shared_subtrees": most, "quantise_nodes": 16}, 600)
      for method in ("bvh-threaded", "bvh-packet") for most in (3, 16, 64)),
    *((method, {}, 8000) for method in ("kd-restart", "kd-ropes", "kd-backtrack", "kd-packet"))],
    ids=lambda o: "-".join(map(str, o.values())) or "plain" if isinstance(o, dict) else str(o))
def test_more_nodes_than_can_be_indexed(precise_renderer, method: str, options: dict, limit: int,
                                        monkeypatch) -> None:
    """If a tree would have more nodes than float32 can index, its leaves hold more triangles and
    the hits stay the same. The test replaces the limit of 2^24 by a small limit."""
    scene = soup_scene(700, 4)
    rays = RAY_SETS["random"](scene, 800, 5)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    for module in (bvh, kdtree, methods_bvh):
        monkeypatch.setattr(module, "EXACT_INTEGER", limit)
    with rt.Tracer(scene, method, **options) as tracer:
        tree, shared = tracer.accelerator.structure, options.get("shared_subtrees")
        copies = times_stored(shared) if "octants" in options else 1
        nodes = len(tree.axis if method.startswith("kd-") else tree.escape)
        assert limit // copies // 8 < nodes <= limit // copies
        if shared:
            assert OctantCopies.of(tree, shared_subtrees=shared).records <= limit
        assert len(getattr(tree, "references", ())) <= limit
        assert_same_bits(tracer.trace(*rays), expected)
        tracer.update(scene.triangles)
        assert_same_bits(tracer.trace(*rays), expected)


def test_a_lopsided_tree_shares_less(precise_renderer, monkeypatch) -> None:
    """The eight octant copies of a tree may share small subtrees. A lopsided tree has few small
    subtrees, and so may need more records than its node limit assumes. The tracer then builds the
    tree again, with the node limit for eight whole copies."""
    flat = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    triangles = flat * np.float32(1.5) ** np.arange(-60, 60, dtype=np.float32)[:, None, None]
    options = {"octants": True, "shared_subtrees": 16}
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(360).reshape(-1, 3))
    limit = 3 * 110
    for module in (bvh, methods_bvh):
        monkeypatch.setattr(module, "EXACT_INTEGER", limit)
    built_for_shared = build_bvh(triangles, **node_limit(120, times_stored(16)))
    assert OctantCopies.of(built_for_shared, shared_subtrees=16).records > limit
    with rt.Tracer(scene, "bvh-threaded", **options) as tracer:
        tree = tracer.accelerator.structure
        assert OctantCopies.of(tree, shared_subtrees=16).records <= limit


@pytest.mark.parametrize("most", [1, 2, 3, 40, 333, 10**6])
def test_coarsened_kd_trees(most: int) -> None:
    """A leaf that replaces a subtree lists each triangle of the subtree once. The split planes
    above the leaf stay."""
    triangles = random_soup(200, 3)
    fine = build_kdtree(triangles)
    leaf, left = fine.axis == LEAF, fine.left.astype(np.int64)
    loose = LooseKdTree(
        fine.axis, fine.split, np.where(leaf, -1, left), np.where(leaf, -1, left + 1),
        np.where(leaf, left, 0), fine.count.astype(np.int64), fine.references)
    tree = loose.coarsened(most).finish(fine.lo, fine.hi)
    if most == 10**6:
        assert all(np.array_equal(getattr(tree, name), getattr(fine, name))
                   for name in ("axis", "split", "left", "count", "references"))
        return
    assert len(tree.axis) <= most
    assert len(tree.references) <= most or len(tree.axis) == 1
    assert set(tree.references.tolist()) == set(fine.references.tolist())
    leaves = np.flatnonzero(tree.axis == LEAF)
    lo, hi = tree.boxes()
    fine_lo, fine_hi = fine.boxes()
    ends = np.flatnonzero(fine.axis == LEAF)
    for leaf in leaves.tolist():
        held = tree.references[tree.left[leaf]:tree.left[leaf] + tree.count[leaf]]
        inside = ends[(fine_lo[ends] >= lo[leaf]).all(1) & (fine_hi[ends] <= hi[leaf]).all(1)]
        parts = [fine.references[fine.left[k]:fine.left[k] + fine.count[k]] for k in inside]
        assert np.array_equal(held, np.unique(np.concatenate(parts)))


def test_a_limit_is_set_only_if_a_tree_could_exceed_it() -> None:
    """`node_limit` sets a limit only if a tree with the given number of triangles could exceed
    the limit."""
    assert node_limit(10**6) == node_limit(EXACT_INTEGER // 2) == {}
    assert node_limit(EXACT_INTEGER // 2 + 1) == {"most_nodes": EXACT_INTEGER}
    assert node_limit(10**6, 8) == {} and node_limit(1_048_577, 8) == {
        "most_nodes": EXACT_INTEGER // 8}


def test_flat_triangles_are_found_in_every_slice(monkeypatch) -> None:
    triangles = random_soup(50, 6)
    triangles[[0, 9, 21, 49], 2] = triangles[[0, 9, 21, 49], 1]
    expected = bounds.shrink_flat(triangles)
    monkeypatch.setattr(bounds, "AT_ONCE", 7)
    assert (bounds.shrink_flat(triangles) == expected).all()
    assert (expected[[0, 9, 21, 49]] == triangles[[0, 9, 21, 49], :1]).all()
    assert bounds.shrink_flat(triangles[1:9]) is not None


def test_names_may_have_hyphens() -> None:
    assert catalogue.find("soda-hall")[0].name == "sodahall"
    assert catalogue.find("fairy-forest")[0].name == "fairyforest"


LARGE = """
import json, sys
import gpgpu_rt as rt
name, options = sys.argv[1], json.loads(sys.argv[2])
scene = rt.load_scene(name)
with rt.Tracer(scene, **options) as tracer:
    built = tracer.statistics.build_seconds
    tracer.render(size=(256, 256))
    rendered = tracer.statistics.trace_seconds
    rays = [a.reshape(-1, 3)[::997] for a in scene.camera.rays((256, 256))]
    hits = tracer.trace(*rays)
    found = {"triangles": len(scene), "built": built, "rendered": rendered,
             "nodes": len(tracer.accelerator.structure.lo),
             "bytes": tracer.statistics.texture_bytes, "hit": float(hits.hit.mean())}
with rt.Tracer(scene, "brute-force") as tracer:
    other = tracer.trace(*rays)
found["wrong"] = int((hits.t != other.t).sum() + (hits.triangle != other.triangle).sum())
# Do not use ru_maxrss: it begins at the memory of the parent process.
with open("/proc/self/status") as status:
    found["peak"] = next(int(line.split()[1]) * 1024 for line in status if "VmHWM" in line)
print(json.dumps(found))
"""


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("name, gibibytes", [("sodahall", 6), ("powerplant", 16)])
@pytest.mark.parametrize("options", [{}, {"octants": True}], ids=["plain", "octants"])
def test_large_scenes(precise_renderer, name: str, options: dict, gibibytes: float) -> None:
    """Large scenes are built and rendered within their memory limit, and the hits equal the hits
    of brute force. ``pytest -s`` shows time and memory."""
    environment = {**os.environ, "GPGPU_RT_CACHE": "", "GPGPU_RT_SCENES": ""}
    answer = subprocess.run([sys.executable, "-c", LARGE, name, json.dumps(options)], check=True,
                            capture_output=True, text=True, env=environment)
    found = json.loads(answer.stdout)
    print(f"\n{name} {options}: {found}")
    assert found["triangles"] == catalogue.ROWS[name].triangles
    assert found["nodes"] <= EXACT_INTEGER // (8 if options else 1)
    assert found["hit"] > 0.2 and found["wrong"] == 0
    assert found["peak"] < gibibytes * 2**30
