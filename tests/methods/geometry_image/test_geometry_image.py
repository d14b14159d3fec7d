"""geometry-image: hits in geometry images equal hits in meshes to the bit. Further tests cover
pyramids of boxes built by GPU passes, the option `level`, seams and moving positions."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, schedules_of

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.geometry_image.boxes import image_boxes
from gpgpu_rt.methods.geometry_image.tree import ImageTree, build_image_tree, build_triangle_image
from gpgpu_rt.session import scene_tables

ROW = find_method("geometry-image")
SHAPES = {"square": [(17, 17)], "strip": [(2, 300)], "column": [(130, 3)], "odd": [(7, 12)],
          "quad": [(2, 2)], "several": [(9, 6), (2, 2), (33, 20), (3, 2)]}


def sheet(shape: tuple[int, int], seed: int, height: float = 0.2) -> np.ndarray:
    """Return a rough height field over the unit square, (rows, columns, 3)."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(np.linspace(0, 1, shape[1]), np.linspace(0, 1, shape[0]))
    return np.stack([x, seed % 5 * 0.1 + height * rng.random(shape), z], axis=2)


def image(shapes: list[tuple[int, int]], seed: int) -> rt.GeometryImage:
    return rt.GeometryImage([sheet(shape, seed + k) for k, shape in enumerate(shapes)])


def poles(rows: int = 12, columns: int = 20) -> np.ndarray:
    """Return a sphere with closed seams, (rows, columns, 3).

    The first row is a single point, and so is the last row. The last column equals the first.
    """
    down, around = np.linspace(0, np.pi, rows), np.linspace(0, 2 * np.pi, columns)
    around[-1] = 0
    radius = np.sin(down)
    radius[[0, -1]] = 0
    return np.stack([radius[:, None] * np.cos(around), np.cos(down)[:, None] + 0 * around,
                     radius[:, None] * np.sin(around)], axis=2)


def trace(scene: rt.Scene, method: str, rays, **options) -> rt.Hits:
    with rt.Tracer(scene, method, **options) as tracer:
        hits = tracer.trace(*rays)
    assert not hits.status.any()
    return hits


def threaded_subtree(tree: ImageTree, node: int) -> list[int]:
    """Return the leaves that the links visit from a node to the end of its subtree."""
    leaves, at = [], node
    while at != tree.miss[node]:
        if tree.hit[at] < 0:
            leaves.append(-1 - int(tree.hit[at]))
            at = int(tree.miss[at])
        else:
            at = int(tree.hit[at])
    return leaves


@pytest.mark.parametrize("name", SHAPES)
def test_links_lead_through_every_cell_once(name: str) -> None:
    tree = build_image_tree(SHAPES[name])
    cells, node = [], tree.root
    while node >= 0:    # a root's miss link is the next root
        cells.append(threaded_subtree(tree, node))
        node = int(tree.miss[node])
    assert [len(part) for part in cells] == [(r - 1) * (c - 1) for r, c in SHAPES[name]]
    leaves = np.concatenate(cells)
    assert sorted(leaves) == list(range(len(tree.corner)))
    assert sorted(tree.face.tolist()) == list(range(0, len(tree.faces), 2))
    for leaf in range(len(tree.corner)):     # a cell and its two faces have the same corners
        a, b, c = tree.faces[tree.face[leaf]]
        assert (a, b, c) == (tree.corner[leaf], a + tree.across[leaf], b + tree.down[leaf])
        assert tree.faces[tree.face[leaf] + 1].tolist() == [a, c, a + tree.down[leaf]]


@pytest.mark.parametrize("storage", ["fp32", "fp16"])
@pytest.mark.parametrize("name", [*SHAPES, "large", "soup"])
def test_passes_make_the_boxes_that_numpy_makes(gpu, name: str, storage: str) -> None:
    """In the shape `large`, a level of a pyramid begins within a row of its table, spans several
    rows and ends within a row."""
    if name == "soup":
        corners = random_soup(5000, 3).reshape(-1, 3)
        scene = rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))
    else:
        scene = image(SHAPES.get(name, [(140, 90), (70, 70)]), 4).scene()
    with rt.Tracer(scene, ROW.name, storage=storage) as tracer:
        tree = tracer.accelerator.structure
        expected = image_boxes(tree, tracer.precision.stored(
            tracer.accelerator.tables["position"]["at"]))
        suffix = "_half" if storage == "fp16" else ""
        with gpu:
            found = [read_texture(tracer.session.tables[record][f"{record}{suffix}_table"])
                     .reshape(-1, 4)[:len(tree.miss)] for record in ("min_pyramid", "max_pyramid")]
    for texels, corners, links in zip(found, expected, (tree.miss, tree.hit)):
        assert np.array_equal(texels[:, :3], corners)
        # In fp32, the fourth channel holds the tree's links. A colour mask keeps the passes from
        # overwriting the links.
        assert storage == "fp16" or np.array_equal(texels[:, 3], links)


@pytest.mark.parametrize("octants", [False, True])
@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("rays", ["random", "vertices", "edges"])
@pytest.mark.parametrize("name", SHAPES)
def test_images_give_the_bits_of_meshes(precise_renderer, name: str, rays: str, seed: int,
                                        octants: bool) -> None:
    scene = image(SHAPES[name], seed).scene()
    assert scene.charts
    chosen = RAY_SETS[rays](scene, 3000, seed)
    assert_same_bits(trace(scene, ROW.name, chosen, octants=octants),
                     trace(scene, "brute-force", chosen))


@pytest.mark.parametrize("schedule", [name for name in schedules_of(ROW) if name != "loop"])
def test_images_under_every_schedule(precise_renderer, schedule: str) -> None:
    scene = image(SHAPES["several"], 6).scene()
    chosen = RAY_SETS["random"](scene, 1500, 6)
    assert_same_bits(trace(scene, ROW.name, chosen, **schedules_of(ROW)[schedule]),
                     trace(scene, ROW.name, chosen))


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("test", ["woop-watertight", "moller-trumbore"])
def test_triangles_without_area_are_never_hit(precise_renderer, test: str, seed: int) -> None:
    """At a sphere's poles, one triangle of each cell is a line. The other charts add triangles
    that are points or lines."""
    rng = np.random.default_rng(seed)
    charts = [poles(), sheet((20, 20), seed)]
    charts[1][4:9, 5:8] = charts[1][4, 5]                                       # points
    # Coordinates with few bits keep the lines exact. The triangle test shears a line, and with
    # rounded coordinates the sheared line may enclose an area.
    one, two = np.arange(20)[:, None] * rng.integers(-9, 9, (2, 1, 3)) / 64
    charts += [np.stack([one, 3 * one, one]) + (2, 0, 1), np.stack([two] * 4) + (-1, 2, 1)]
    scene = rt.GeometryImage(charts).scene()
    chosen = RAY_SETS["vertices"](scene, 4000, seed)
    some = rng.integers(len(scene), size=len(chosen[0]))
    aims = scene.triangles[some].mean(axis=1)
    for directions in (chosen[1], aims - chosen[0]):
        rays = chosen[0], directions
        hits = trace(scene, ROW.name, rays, intersection=test)
        assert_same_bits(hits, trace(scene, "brute-force", rays, intersection=test))
        v0, v1, v2 = scene.triangles[hits.triangle[hits.hit]].astype(np.float64).transpose(1, 0, 2)
        assert (np.cross(v1 - v0, v2 - v0) != 0).any(axis=1).all()


@pytest.mark.parametrize("level", [1, 2, 3, 20])
@pytest.mark.parametrize("name", ["square", "odd", "several", "strip"])
def test_a_coarser_level_is_the_mesh_of_its_quads(precise_renderer, name: str, level: int) -> None:
    """The coarse mesh has every 2^level-th row and column, and the last row and column.

    A hit on a coarse quad reports a face of the quad's first cell.
    """
    made = image(SHAPES[name], 3)
    scene, step = made.scene(), 2**level
    coarse, first = np.repeat(scene.triangles[:, :1], 3, axis=1), 0
    for chart in made.charts:
        rows, columns = len(chart), chart.shape[1]
        for r in range(0, rows - 1, step):
            for c in range(0, columns - 1, step):
                below, beside = min(r + step, rows - 1), min(c + step, columns - 1)
                a, b, d = chart[r, c], chart[r, beside], chart[below, c]
                face = first + 2 * (r * (columns - 1) + c)
                coarse[face], coarse[face + 1] = (a, b, chart[below, beside]), (
                    a, chart[below, beside], d)
        first += 2 * (rows - 1) * (columns - 1)
    chosen = RAY_SETS["random"](scene, 3000, level)
    hits = trace(scene, ROW.name, chosen, level=level)
    assert_same_bits(hits, trace(replace(scene, triangles=coarse), "brute-force", chosen))
    assert hits.hit.any()
    pictures = []
    for method, shown, options in ((ROW.name, scene, {"level": level}),
                                   ("brute-force", replace(scene, triangles=coarse), {})):
        with rt.Tracer(shown, method, **options) as tracer:
            pictures.append(np.asarray(tracer.render(scene.camera, (32, 32))))
    assert np.array_equal(*pictures)


def test_levels_save_work_and_stay_near() -> None:
    """A coarser level takes fewer steps, and its hits stay near the hits of the finer level."""
    x, z = np.meshgrid(*[np.linspace(0, 1, 65)] * 2)
    scene = rt.GeometryImage([np.stack([x, 0.1 * np.sin(5 * x) * np.cos(4 * z), z], 2)]).scene()
    rays = scene.camera.rays((40, 40))
    counted = []
    for level in range(4):
        with rt.Tracer(scene, ROW.name, level=level, statistics=True) as tracer:
            counted.append((tracer.trace(*rays), tracer.statistics.counters["steps"]))
    both = np.logical_and.reduce([hits.hit for hits, _ in counted])
    assert both.mean() > 0.1
    for (fine, more), (coarse, less) in zip(counted, counted[1:]):
        assert less < more
        assert np.median(np.abs(fine.t[both] - coarse.t[both])) < 0.02


def test_a_level_needs_an_image() -> None:
    with pytest.raises(rt.OptionError, match="remesh") as caught:
        rt.Tracer("cornell", ROW.name, level=1)
    assert "\n" not in str(caught.value)


def test_charts_must_match_the_triangles() -> None:
    scene = image(SHAPES["odd"], 1).scene()
    with pytest.raises(rt.SceneError, match="charts"):
        replace(scene, charts=((3, 3),))
    moved = scene.triangles.copy()
    moved[7, 1] += 1
    with pytest.raises(rt.SceneError, match="charts"):
        rt.Tracer(replace(scene, triangles=moved), ROW.name)


@pytest.mark.parametrize("charts, message", [
    ([np.zeros((1, 5, 3))], "chart 0 has shape"), ([np.zeros((4, 4))], "chart 0 has shape"),
    (np.zeros((4, 4, 3)), "chart 0 has shape"), (["abc"], "array of numbers"),
    ([np.zeros((2, 2, 3)), np.full((2, 2, 3), np.nan)], "chart 1 .*finite")])
def test_broken_charts(charts, message: str) -> None:
    with pytest.raises(rt.SceneError, match=message) as caught:
        rt.GeometryImage(charts)
    assert "\n" not in str(caught.value)


def test_single_triangles_lie_along_the_curve() -> None:
    """Triangles without charts lie along a Morton curve, so neighbours share small boxes."""
    triangles = random_soup(700, 8)
    tree = build_triangle_image(triangles)
    assert np.array_equal(tree.positions(triangles)[tree.faces], triangles)
    assert tree.charts == () and sorted(tree.face.tolist()) == list(range(700))
    lo, hi = image_boxes(tree, tree.positions(triangles))
    spans = np.diff(tree.levels)
    assert spans.tolist() == [700, 175, 44, 11, 3, 1]
    sizes = [float(np.prod(hi[a:b] - lo[a:b], axis=1).mean())
             for a, b in zip(tree.levels, tree.levels[1:])]
    assert sizes == sorted(sizes) and sizes[2] < 0.2 * sizes[-1]


def test_vertices_at_one_place_have_one_normal() -> None:
    """Vertices at the same place, on a seam or at a pole, have the same normal."""
    normals = rt.GeometryImage([poles(40, 60)]).normals()[0]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1, atol=1e-6)
    assert np.array_equal(normals[:, 0], normals[:, -1])
    assert (normals[0] == normals[0, 0]).all() and abs(normals[0, 0, 1]) > 0.999
    outward = (normals * poles(40, 60)).sum(axis=2)
    assert np.abs(outward).min() > 0.99 and (outward > 0).all() | (outward < 0).all()


# Moving ------------------------------------------------------------------------------------------

@pytest.mark.parametrize("options", [{}, {"octants": True}, {"level": 1}, {"storage": "fp16"}],
                         ids=str)
def test_updates_equal_fresh_builds(precise_renderer, monkeypatch, options: dict) -> None:
    """After an update, hits equal those of a new tracer. An update writes only positions."""
    made = image(SHAPES["several"], 9)
    places = [made.positions * np.float32([1, k, 1]) + np.float32([0, 0, k]) for k in range(3)]
    places[2][:] = np.random.default_rng(3).random(places[2].shape)
    with rt.Tracer(made.scene(), ROW.name, **options) as tracer:
        textures = {name: dict(tables) for name, tables in tracer.session.tables.items()}
        for at in places:
            tracer.update(at)
            assert not tracer.statistics.rebuilt
            scene = made.moved(at).scene()
            chosen = RAY_SETS["random"](scene, 1500, 5)
            hits = tracer.trace(*chosen)
            assert_same_bits(hits, trace(scene, ROW.name, chosen, **options))
            assert hits.hit.mean() > 0.1
        assert tracer.session.tables == textures
        written, write = [], scene_tables.table_textures
        monkeypatch.setattr(scene_tables, "table_textures", lambda gpu, record, *rest: (
            written.append(record.name) or write(gpu, record, *rest)))
        tracer.update(places[0])
    assert written == ["position"]


def test_updates_of_triangles_that_lose_their_area(precise_renderer) -> None:
    made = image([(12, 12)], 2)
    flat = made.positions.copy()
    flat[40:70] = flat[40]
    with rt.Tracer(made.scene(), ROW.name) as tracer:
        for at in (flat, made.positions, flat):
            tracer.update(at)
            scene = made.moved(at).scene()
            chosen = RAY_SETS["vertices"](scene, 1500, 5)
            assert_same_bits(tracer.trace(*chosen), trace(scene, "brute-force", chosen))


def test_a_soup_is_refitted_too(precise_renderer) -> None:
    corners = random_soup(300, 4).reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    with rt.Tracer(rt.Scene.from_arrays(corners, faces), ROW.name) as tracer:
        tracer.update(corners[::-1].copy())
        assert not tracer.statistics.rebuilt
        scene = rt.Scene.from_arrays(corners[::-1], faces)
        chosen = RAY_SETS["random"](scene, 2000, 5)
        assert_same_bits(tracer.trace(*chosen), trace(scene, "brute-force", chosen))


@pytest.mark.parametrize("options", [{}, {"octants": True}, {"level": 2}, {"storage": "fp24"},
                                     {"storage": "fp16"}], ids=str)
@pytest.mark.parametrize("program", ["wave", "twist"])
def test_deformed_in_a_shader(precise_renderer, program: str, options: dict) -> None:
    """A scene that a shader has deformed has the hits of a new scene with the same positions.

    The positions are read back from the GPU. A deformation without readback gives the same hits.
    """
    made = rt.GeometryImage([poles(), *image(SHAPES["several"], 5).charts])
    with rt.Tracer(made.scene(), ROW.name, **options) as tracer, \
            rt.Deformation(tracer, program) as deformation:
        rest = tracer.scene.triangles
        for time in (0.5, 2.0):
            deformation.to(time)
            scene = tracer.scene
            assert not np.array_equal(scene.triangles, rest)
            chosen = RAY_SETS["random"](scene, 2000, 5)
            hits = tracer.trace(*chosen)
            assert_same_bits(hits, trace(scene, ROW.name, chosen, **options))
            if not options:
                assert_same_bits(hits, trace(scene, "brute-force", chosen))
            picture = np.asarray(tracer.render(scene.camera, (24, 24)))
            with rt.Tracer(scene, ROW.name, **options) as fresh:
                assert np.array_equal(picture, np.asarray(fresh.render(scene.camera, (24, 24))))
        deformation.to(1.0)
        deformation.to(2.0, read_back=False)
        assert_same_bits(tracer.trace(*chosen), hits)


def test_a_deformation_keeps_seams_closed() -> None:
    scene = rt.load_scene("boulder")
    with rt.Tracer(scene, ROW.name) as tracer, rt.Deformation(tracer, "twist") as deformation:
        deformation.to(1.3)
        aims = np.unique(tracer.scene.triangles.reshape(-1, 3), axis=0)
        assert len(aims) == len(np.unique(scene.triangles.reshape(-1, 3), axis=0))
        assert tracer.trace(np.zeros_like(aims), aims).hit.all()


def test_a_user_s_deformation_and_wrong_deformations(tmp_path) -> None:
    scene = image([(5, 5)], 1).scene()
    own = tmp_path / "own.glsl"
    own.write_text("vec3 deform(vec3 rest, float time) { return rest + vec3(time); }")
    with rt.Tracer(scene, ROW.name) as tracer:
        for program in (own, own.read_text()):
            with rt.Deformation(tracer, program) as deformation:
                deformation.to(2.0)
                assert np.allclose(tracer.scene.triangles, scene.triangles + 2, atol=1e-6)
                deformation.to(0.0)
        for program, message in (("wav", "wave"), (tmp_path / "gone.glsl", "no deformation"),
                                 ("vec3 deform(vec3 rest) { return rest; }", "deform")):
            with pytest.raises(rt.ShaderError, match=message) as caught:
                rt.Deformation(tracer, program)
            assert "\n" not in str(caught.value)
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        with pytest.raises(rt.OptionError, match="geometry-image"):
            rt.Deformation(tracer, "wave")


def test_deformations_are_refused_within_counting_and_after_release() -> None:
    with rt.Tracer("boulder", ROW.name) as tracer, rt.Deformation(tracer, "twist") as deformation:
        with tracer.counting(), pytest.raises(rt.OptionError, match="within counting"):
            deformation.to(0.5)
        before = tracer.eye_hits(size=(16, 16))
        deformation.to(0.0)
        assert_same_bits(tracer.eye_hits(size=(16, 16)), before)
        tracer.release()
        with pytest.raises(rt.Error, match="released"):
            deformation.to(0.5)


def test_the_rasteriser_follows_a_deformation(precise_renderer) -> None:
    with rt.Tracer("boulder", ROW.name) as tracer, rt.Deformation(tracer, "twist") as deformation:
        for time in (0.0, 0.5):
            deformation.to(time)
            traced, rasterised = (tracer.eye_hits(size=(64, 64), first_hits=kind)
                                  for kind in ("traced", "rasterised"))
            assert_same_bits(rasterised, traced)
            assert traced.hit.any()
        deformation.to(0.7, read_back=False)
        with pytest.raises(rt.OptionError, match="read_back"):
            tracer.eye_hits(size=(8, 8), first_hits="rasterised")
