"""Tests the geometry images of built-in scenes, and the images that `remesh` makes from meshes.
The image of a closed surface is closed."""
from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from conftest import assert_same_bits, real_scene

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.scene.surfaces.embedding import embed
from gpgpu_rt.scene.surfaces.surface_mesh import SurfaceMesh

METHOD = "geometry-image"


def blob(seed: int, subdivisions: int = 3) -> trimesh.Trimesh:
    """Return a closed, oriented, lumpy surface with three horns."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    at = mesh.vertices
    rng = np.random.default_rng(seed)
    for way in rng.normal(size=(3, 3)):
        way /= np.linalg.norm(way)
        at = at + 1.5 * way * np.exp(-6 * ((mesh.vertices - way) ** 2).sum(axis=1))[:, None]
    mesh.vertices = at
    return mesh


def edges_of(scene: rt.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct corners, and the half-edges between corners, (k, 2) indices.

    Triangles with two equal corners are left out.
    """
    places, index = np.unique(scene.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return places, np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def is_closed(scene: rt.Scene) -> bool:
    """Return whether each edge has as many half-edges in one direction as in the other."""
    places, edges = edges_of(scene)
    counts = [np.unique(edges[:, order] @ (len(places), 1), return_counts=True)
              for order in ([0, 1], [1, 0])]
    return all(np.array_equal(one, two) for one, two in zip(*counts))


def border_points(scene: rt.Scene, rng: np.random.Generator) -> np.ndarray:
    """Return the texels on the borders of charts, and a random point between any two neighbouring
    texels of a border."""
    points, first = [], 0
    positions = np.empty((scene.faces.max() + 1, 3), np.float32)
    positions[scene.faces] = scene.triangles
    for rows, columns in scene.charts:
        chart = positions[first:first + rows * columns].reshape(rows, columns, 3)
        for line in (chart[0], chart[-1], chart[:, 0], chart[:, -1]):
            share = rng.random((len(line) - 1, 1))
            points += [line, line[:-1] * share + line[1:] * (1 - share)]
        first += rows * columns
    return np.concatenate(points)


def assert_no_leak(scene: rt.Scene, inside: np.ndarray, seed: int) -> None:
    """Check that all rays from the point ``inside`` hit the surface. The rays aim at every texel
    of the charts' borders, at points between these texels, and in random directions."""
    rng = np.random.default_rng(seed)
    aims = border_points(scene, rng).astype(np.float32) - inside.astype(np.float32)
    directions = np.concatenate([aims, rng.normal(size=(2000, 3)).astype(np.float32)])
    origins = np.broadcast_to(inside.astype(np.float32), directions.shape)
    for options in ({}, {"octants": True}):
        with rt.Tracer(scene, METHOD, **options) as tracer:
            hits = tracer.trace(origins, directions)
        assert hits.hit.all(), f"{(~hits.hit).sum()} of {len(hits)} rays leak"


@pytest.mark.parametrize("name", ["boulder", "knot", "cloth", "car"])
def test_built_images(precise_renderer, name: str) -> None:
    scene = rt.load_scene(name)
    assert scene.charts and is_closed(scene) == (name != "cloth")
    rays = scene.camera.rays((48, 48))
    with rt.Tracer(scene, METHOD) as images, rt.Tracer(scene, "bvh-threaded") as mesh:
        assert images.accelerator.structure.charts == scene.charts
        assert_same_bits(images.trace(*rays), mesh.trace(*rays))


def test_the_car_in_one_pass_equals_its_five_images_one_after_another(precise_renderer) -> None:
    """Carr et al. traced each image by itself. One pass over all five images finds the same hits
    as five passes. The single pass visits fewer nodes, because the nearest t of an image shortens
    the search in the next image."""
    car = rt.load_scene("car")
    assert len(car.charts) == 5 and car.stand_in
    counts = [2 * (rows - 1) * (columns - 1) for rows, columns in car.charts]
    assert sum(counts) == len(car.triangles)
    origins, directions = (part.reshape(-1, 3) for part in car.camera.rays((64, 48)))
    with rt.Tracer(car, METHOD, statistics=True) as tracer:
        whole = tracer.trace(origins, directions)
    with rt.Tracer(car, "brute-force") as tracer:
        assert_same_bits(whole, tracer.trace(origins, directions))
    t, triangle = np.full(len(origins), np.inf, np.float32), np.full(len(origins), -1)
    visited, first = 0, 0
    for shape, count in zip(car.charts, counts):
        part = rt.Scene("part", car.triangles[first:first + count],
                        car.colours[first:first + count], car.light, car.camera, charts=(shape,))
        with rt.Tracer(part, METHOD, statistics=True) as tracer:
            hits = tracer.trace(origins, directions)
        assert hits.hit.any()
        nearer = hits.hit & (hits.t < t)
        t[nearer], triangle[nearer] = hits.t[nearer], hits.triangle[nearer] + first
        visited, first = visited + int(hits.nodes_visited.sum()), first + count
    assert np.array_equal(triangle, whole.triangle)
    assert whole.nodes_visited.sum() < visited


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_no_ray_leaks_between_charts(seed: int) -> None:
    assert_no_leak(rt.load_scene("boulder"), np.random.default_rng(seed).normal(size=3) * 0.2,
                   seed)


def test_the_leak_test_notices_an_open_seam() -> None:
    scene = rt.load_scene("boulder")
    triangles = scene.triangles.copy()
    triangles[:len(triangles) // 6] *= np.float32(0.99)    # one chart shrinks
    open_one = rt.Scene("open", triangles, scene.colours, scene.light, scene.camera,
                        charts=scene.charts)
    assert not is_closed(open_one)
    with pytest.raises(AssertionError, match="leak"):
        assert_no_leak(open_one, np.zeros(3), 1)


# Images that `remesh` makes of meshes ------------------------------------------------------------

@pytest.mark.parametrize("size", [16, 64])
@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_a_closed_mesh_becomes_a_closed_image(seed: int, size: int) -> None:
    mesh = blob(seed)
    scene = rt.remesh(mesh, size).scene()
    assert scene.charts == ((size + 1, size + 1),) and is_closed(scene)
    assert_no_leak(scene, np.zeros(3), seed)
    # The image has the orientation of the mesh, so the signed volumes are about equal.
    v0, v1, v2 = scene.triangles.astype(np.float64).transpose(1, 0, 2)
    volume = (v0 * np.cross(v1, v2)).sum() / 6
    assert volume == pytest.approx(mesh.volume, rel=0.3 if size == 16 else 0.05)


def test_cuts_let_the_image_reach_the_horns() -> None:
    """With cuts, the image reaches the tips of the horns."""
    mesh = blob(3)
    reached = [np.linalg.norm(rt.remesh(mesh, 48, cuts=cuts).positions, axis=1).max()
               for cuts in (0, 8)]
    tip = np.linalg.norm(mesh.vertices, axis=1).max()
    assert reached[1] > 0.97 * tip and reached[1] >= reached[0]


@pytest.mark.parametrize("size, cuts, torn", [(64, 8, False), (48, 0, True), (12, 8, True)])
def test_the_distance_to_the_surface_is_measured(capsys, tmp_path, size: int, cuts: int,
                                                 torn: bool) -> None:
    """The reported distance bounds how far the vertices of the mesh are from the triangles of the
    image."""
    mesh = blob(3)
    mesh.export(tmp_path / "blob.ply")
    words = ["--size", str(size), "--cuts", str(cuts), "--json", "-o", str(tmp_path / "blob.npz")]
    assert cli.main(["remesh", str(tmp_path / "blob.ply"), *words]) == 0
    out, err = capsys.readouterr()
    share = json.loads(out)["largest_distance"]
    assert ("torn" in err) == torn == (share > 0.02)
    texels = rt.GeometryImage.load(tmp_path / "blob.npz").positions.astype(np.float64)
    corners = mesh.vertices[:, None] - texels[None]
    extent = np.ptp(mesh.vertices, axis=0).max()
    nearest = np.sqrt((corners ** 2).sum(axis=2).min(axis=1)).max() / extent
    # Texels are the corners of the image's triangles. So the texel nearest to a vertex is farther
    # away than the nearest triangle by at most about a triangle's edge. `edge` is the longest edge
    # between two rows of texels.
    edge = np.linalg.norm(np.diff(texels.reshape(size + 1, size + 1, 3), axis=0), axis=2).max()
    assert nearest - edge / extent <= share < 2 * nearest + 0.02


def test_a_disc_keeps_its_border_and_its_shape() -> None:
    x, z = np.meshgrid(np.linspace(0, 2, 21), np.linspace(0, 1, 15))
    chart = np.stack([x, 0.3 * np.sin(3 * x) * np.cos(2 * z), z], axis=2)
    image = rt.remesh(rt.GeometryImage([chart]).scene(), 40).charts[0]
    corners = {tuple(corner) for corner in image[[0, 0, -1, -1], [0, -1, 0, -1]].tolist()}
    assert corners & {tuple(c) for c in chart[[0, 0, -1, -1], [0, -1, 0, -1]].astype(
        np.float32).tolist()}
    border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    on_border = np.minimum.reduce([border[:, 0], 2 - border[:, 0], border[:, 2],
                                   1 - border[:, 2]])
    assert np.abs(on_border).max() < 1e-6
    height = 0.3 * np.sin(3 * image[..., 0]) * np.cos(2 * image[..., 2])
    assert np.abs(image[..., 1] - height).max() < 0.02


def test_the_embedding_turns_no_triangle_over() -> None:
    """With convex weights and a convex border, every triangle keeps its orientation (Tutte)."""
    mesh = SurfaceMesh.of_triangles(blob(4).triangles)
    distance = mesh.distances(np.array([0]))
    opened, _ = mesh.cut(mesh.edges_along(mesh.path(distance, int(distance.argmax()))))
    loop = opened.loops()[0]
    angle = -2 * np.pi * np.arange(len(loop)) / len(loop)
    flat = embed(opened, opened.start[loop], 50 + 50 * np.stack([np.cos(angle), np.sin(angle)], 1),
                 100)
    p, q, r = flat[opened.faces].transpose(1, 0, 2)
    area = (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]
    assert (area < 0).all() or (area > 0).all()


@pytest.mark.full
def test_the_bunny_becomes_an_image() -> None:
    mesh = real_scene("bunny")
    scene = rt.remesh(mesh, 64, cuts=3).scene()
    assert np.abs(np.array(scene.bounds) - mesh.bounds).max() < 0.5 * mesh.extent


def test_images_in_files(capsys, tmp_path) -> None:
    mesh = tmp_path / "blob.ply"
    blob(1, 2).export(mesh)
    target = tmp_path / "blob.npz"
    assert cli.main(["remesh", str(mesh), "-o", str(target), "--size", "16"]) == 0
    assert "17 x 17 positions, 512 triangles" in capsys.readouterr().out
    scene = rt.load_scene(target)
    assert scene.charts == ((17, 17),) and scene.name == "blob" and is_closed(scene)
    assert np.array_equal(scene.triangles, rt.GeometryImage.load(target).scene().triangles)
    assert cli.main(["render", str(target), "-m", METHOD, "--level", "1", "--size", "16", "-o",
                     str(tmp_path / "blob.png")]) == 0
    several = rt.GeometryImage([np.random.default_rng(k).random((3, 2 + k, 3)) for k in range(12)])
    several.save(tmp_path / "several.npz")
    assert all(map(np.array_equal, rt.GeometryImage.load(tmp_path / "several.npz").charts,
                   several.charts))


@pytest.mark.parametrize("arguments, message", [
    (["remesh", "{}/blob.ply", "-o", "{}/x.png"], ".npz"),
    (["remesh", "{}/blob.ply", "-o", "{}/no/x.npz"], "no folder"),
    (["remesh", "{}/blob.ply", "-o", "{}/x.npz", "--size", "2"], "size of 4 or more"),
    (["remesh", "cornell", "-o", "{}/x.npz"], "parts"),
    (["render", "{}/gone.npz", "-o", "{}/x.png"], "no such file"),
    (["render", "{}/noise.npz", "-o", "{}/x.png"], "cannot read"),
    (["render", "{}/other.npz", "-o", "{}/x.png"], "chart_0"),
    (["render", "{}/flat.npz", "-o", "{}/x.png"], "shape"),
])
def test_mistakes_with_files_are_one_line(capsys, tmp_path, arguments: list[str],
                                          message: str) -> None:
    blob(1, 1).export(tmp_path / "blob.ply")
    (tmp_path / "noise.npz").write_bytes(b"PK not an archive")
    np.savez(tmp_path / "other.npz", stuff=np.zeros(3))
    np.savez(tmp_path / "flat.npz", chart_0=np.zeros((3, 3)))
    before = sorted(tmp_path.iterdir())
    assert cli.main([a.replace("{}", str(tmp_path)) for a in arguments]) == 1
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_surface_mesh_counts_fills_and_cuts() -> None:
    """`SurfaceMesh` counts parts and border loops, fills holes, finds paths and cuts along
    them."""
    ball = SurfaceMesh.of_triangles(trimesh.creation.icosphere(subdivisions=2).triangles)
    assert (ball.parts(), ball.euler(), ball.loops()) == (1, 2, [])
    ring = SurfaceMesh.of_triangles(trimesh.creation.torus(1, 0.3).triangles)
    assert (ring.parts(), ring.euler()) == (1, 0)
    tube = SurfaceMesh.of_triangles(trimesh.creation.cylinder(1, 2, sections=9).triangles)
    keep = np.abs(tube.vertices[tube.faces][:, :, 2].mean(axis=1)) < 0.9     # no lids
    tube = SurfaceMesh(tube.vertices, tube.faces[keep])
    assert sorted(map(len, tube.loops())) == [9, 9]
    filled = tube.filled(tube.loops()[1:])
    assert len(filled.loops()) == 1 and len(filled.faces) == len(tube.faces) + 9
    distance = ball.distances(np.array([0]))
    way = ball.path(distance, int(distance.argmax()))
    steps = np.linalg.norm(np.diff(ball.vertices[way], axis=0), axis=1)
    assert steps.sum() == pytest.approx(distance.max())
    opened, was = ball.cut(ball.edges_along(way))
    assert (opened.parts(), opened.euler()) == (1, 1)
    assert len(opened.loops()[0]) == 2 * (len(way) - 1)
    assert np.bincount(was).max() == 2 and len(was) == len(ball.vertices) + len(way) - 2


@pytest.mark.parametrize("mesh, message", [
    (trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation(
        [5, 0, 0])]), "2 parts"),
    (trimesh.creation.torus(1, 0.3), "handles"),
    (trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 2, 3]],
                     process=False), "same way"),
    (trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False), "boundary"),
    (trimesh.Trimesh([[0, 0, 0], [1, 1, 1]], [[0, 1, 1]], process=False), "no triangle"),
])
def test_surfaces_that_are_refused(mesh, message: str) -> None:
    """`remesh` refuses unsuitable meshes, and wrong values of size and cuts."""
    with pytest.raises(rt.SceneError, match=message) as caught:
        rt.remesh(mesh, 16)
    assert "\n" not in str(caught.value)
    for size, cuts in ((3, 1), (16, -1)):
        with pytest.raises(rt.OptionError, match="remesh"):
            rt.remesh(trimesh.creation.box(), size, cuts)
