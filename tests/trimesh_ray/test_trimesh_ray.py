"""The intersector for trimesh gives the same answers as trimesh's engine without Embree. Its
arrays have the same shapes as the arrays of both engines of trimesh."""
from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector as Embree
from trimesh.ray.ray_triangle import RayMeshIntersector as Native

import gpgpu_rt as rt
from gpgpu_rt.trimesh_ray import RayMeshIntersector

PAGE = Path(rt.__file__).parents[1] / "docs" / "how-to" / "trimesh.md"
OURS = {"bvh-threaded": {}, "kd-short-stack": {},
        "bvh-packet": {"packet": (2, 2), "presort": True},
        "grid": {"schedule": "step", "steps_per_pass": 8}}
ENGINES = {"native": Native, "embree": Embree,
           **{name: lambda mesh, name=name, options=options: RayMeshIntersector(
               mesh, name, **options) for name, options in OURS.items()}}
# trimesh's use of Embree is not exact: a search continues slightly behind the previous hit.
EXACT = [name for name in ENGINES if name != "embree"]


@pytest.fixture(params=ENGINES)
def engine(request):
    return ENGINES[request.param]


@pytest.fixture(params=EXACT)
def exact(request):
    return ENGINES[request.param]


def random_rays(mesh: trimesh.Trimesh, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    return mesh.bounds.mean(axis=0) + 1.5 * mesh.scale * rng.uniform(-0.5, 0.5, (count, 3)), \
        directions


def closed(name: str) -> trimesh.Trimesh:
    make = {"box": lambda: trimesh.creation.box(extents=(1, 2, 3)),
            "ball": lambda: trimesh.creation.icosphere(subdivisions=2),
            "tube": lambda: trimesh.creation.annulus(r_min=0.4, r_max=1, height=2)}[name]
    return make()


@pytest.mark.parametrize("name", ["box", "ball", "tube"])
def test_shapes_types_and_return_order(engine, name: str) -> None:
    mesh = closed(name)
    ray = engine(mesh)
    origins, directions = random_rays(mesh, 90, 1)
    tri, rays = ray.intersects_id(origins, directions)
    assert tri.shape == rays.shape == (len(tri),) and len(tri) > 10
    assert tri.dtype.kind == rays.dtype.kind == "i" and tri.max() < len(mesh.faces)
    tri, rays, at = ray.intersects_id(origins, directions, return_locations=True)
    assert at.shape == (len(tri), 3) == (len(rays), 3) and at.dtype == np.float64
    at, rays, tri = ray.intersects_location(origins, directions)
    assert at.shape == (len(tri), 3) == (len(rays), 3) and len(np.unique(rays)) > 5
    off = mesh.triangles[tri] - at[:, None]
    assert np.abs((off[:, 0] * mesh.face_normals[tri]).sum(axis=1)).max() < 1e-6
    first = ray.intersects_first(origins, directions)
    assert first.shape == (90,) and first.dtype.kind == "i"
    hit = ray.intersects_any(origins, directions)
    assert hit.shape == (90,) and hit.dtype == bool and (hit == (first >= 0)).all()
    inside = ray.contains_points(origins)
    assert inside.shape == (90,) and inside.dtype == bool


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("name", ["box", "ball", "tube"])
def test_the_same_hits_as_trimesh_itself(exact, name: str, seed: int) -> None:
    mesh = closed(name)
    rays = random_rays(mesh, 150, seed)
    expected = sorted(zip(*np.array(Native(mesh).intersects_id(*rays))[::-1]))
    assert sorted(zip(*np.array(exact(mesh).intersects_id(*rays))[::-1])) == expected
    assert (exact(mesh).intersects_first(*rays) == Native(mesh).intersects_first(*rays)).all()
    found, known = (ray.intersects_location(*rays) for ray in (exact(mesh), Native(mesh)))
    order, theirs = (np.lexsort((tri, rays)) for _, rays, tri in (found, known))
    assert np.abs(found[0][order] - known[0][theirs]).max() < 1e-13
    assert (found[1][order] == known[1][theirs]).all()


@pytest.mark.parametrize("name", ["box", "ball", "tube"])
def test_points_inside_a_closed_mesh(engine, name: str) -> None:
    mesh = closed(name)
    rng = np.random.default_rng(3)
    points = mesh.bounds[0] + rng.random((400, 3)) * np.ptp(mesh.bounds, axis=0)
    radius, z = np.linalg.norm(points, axis=1), np.abs(points[:, 2])
    flat = np.linalg.norm(points[:, :2], axis=1)
    known, sure = {
        "box": (np.ones(400, bool), np.ones(400, bool)),
        "ball": (radius < 0.9, (radius < 0.9) | (radius > 1)),
        "tube": ((flat > 0.5) & (flat < 0.9) & (z < 1), (np.abs(flat - 0.4) > 0.1)
                 & (np.abs(flat - 1) > 0.1))}[name]
    assert (engine(mesh).contains_points(points) == known)[sure].all()
    assert not engine(mesh).contains_points(points + 10).any()
    with pytest.raises(ValueError, match=r"\(n,3\)"):
        engine(mesh).contains_points(points[:, :2])


def test_rays_at_vertices_and_along_edges(exact) -> None:
    """A ray through a vertex has one location there. A query for triangles returns all triangles
    that meet at the vertex."""
    mesh = trimesh.creation.box()
    origins = np.zeros_like(mesh.vertices)
    ray = exact(mesh)
    assert ray.intersects_any(origins, mesh.vertices).all()
    _, rays, _ = ray.intersects_location(origins, mesh.vertices)
    assert np.bincount(rays, minlength=8).tolist() == [1] * 8
    tri, rays = ray.intersects_id(origins, mesh.vertices)
    around = np.bincount(mesh.faces.ravel(), minlength=8)
    assert np.bincount(rays, minlength=8).tolist() == around.tolist()
    # A ray through the diagonals of two faces enters and leaves the box. It hits two triangles at
    # each of the two locations.
    _, rays, _ = ray.intersects_location([[0.1, 0.1, -9]], [[0, 0, 1]])
    assert len(rays) == 2


@pytest.mark.parametrize("name", OURS)
def test_triangles_that_coincide_are_all_found_in_order(name: str) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    layers = [0, 0, 1e-5, 0.5, 0.5, 0.5]
    mesh = trimesh.Trimesh(np.concatenate([square + [0, 0, z] for z in layers]),
                           np.concatenate([faces + 4 * k for k in range(6)]), process=False)
    ray = ENGINES[name](mesh)
    tri, rays = ray.intersects_id([[0.7, 0.2, -1], [0.7, 0.2, 2]], [[0, 0, 1], [0, 0, -3]])
    assert rays.tolist() == [0] * 6 + [1] * 6
    assert tri.tolist() == [0, 2, 4, 6, 8, 10, 6, 8, 10, 4, 0, 2]
    tri, _ = ray.intersects_id([[0.7, 0.2, -1]], [[0, 0, 1]], max_hits=4)
    assert tri.tolist() == [0, 2, 4, 6]
    tri, rays, at = ray.intersects_id([[0.7, 0.2, -1]], [[0, 0, 1]], multiple_hits=False,
                                      return_locations=True)
    assert tri.tolist() == [0] and np.abs(at - [[0.7, 0.2, 0]]).max() < 1e-12
    at, _, tri = ray.intersects_location([[0.7, 0.2, -1]], [[0, 0, 1]])
    assert tri.tolist() == [0, 4, 6] and np.allclose(at[:, 2], layers[1:4], atol=1e-12)
    for most in (1, 2, 3, 4):  # `max_hits` counts locations, not triangles
        at, _, tri = ray.intersects_location([[0.7, 0.2, -1]], [[0, 0, 1]], max_hits=most)
        assert tri.tolist() == [0, 4, 6][:most]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("length", [1e-300, 1e-46, 1e-41, 1e-38, 1e30, 1e39, 1e300])
def test_directions_of_any_length(length: float) -> None:
    """Directions of any length give the same hits. In an earlier version, t of short directions
    overflowed float32. All hits then were at infinity, in triangle order, with NaN locations."""
    mesh = trimesh.creation.icosphere(subdivisions=2)
    origins, directions = random_rays(mesh, 300, 4)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with RayMeshIntersector(mesh) as ray:
        for found, known in zip(ray.intersects_location(origins, length * directions),
                                ray.intersects_location(origins, directions)):
            assert len(known) > 20 and np.allclose(found, known, rtol=0, atol=1e-5)
        first = ray.intersects_first(origins, directions)
        assert (ray.intersects_first(origins, length * directions) == first).all()
        assert (ray.intersects_any(origins, length * directions) == (first >= 0)).all()
        none = np.array([[0, 0, 0], [np.nan, 1, 0], [np.inf, 1, 0], [0, 1, -np.inf]])
        assert not ray.intersects_any(np.zeros((4, 3)), none).any()


@pytest.mark.parametrize("name", OURS)
def test_a_sheet_seen_from_afar_has_two_sides(name: str) -> None:
    """A ray hits both sides of a box of one millimetre at a distance of ten kilometres, although
    both hits have almost the same t in float32."""
    mesh = trimesh.creation.box(extents=(1e-3, 1e-3, 1e-3))
    rays = [[0, 0, 1e4], [1e-4, 2e-4, 1e4]], [[0, 0, -1.0]] * 2  # the first ray hits diagonals
    with ENGINES[name](mesh) as ray:
        at, index, _ = ray.intersects_location(*rays)
        tri, _ = ray.intersects_id(*rays)
    assert index.tolist() == [0, 0, 1, 1] and len(tri) == 6
    np.testing.assert_allclose(at[:, 2], [5e-4, -5e-4] * 2, atol=1e-9)
    with RayMeshIntersector(mesh, name, coincident=False, **OURS[name]) as ray:
        tri, index, there = ray.intersects_id(*rays, return_locations=True)
        assert index.tolist() == [0, 0, 1, 1] and (there == at).all()
        assert ray.intersects_id(*rays)[0].tolist() == tri.tolist()
        assert copy.copy(ray).intersects_id(*rays)[0].tolist() == tri.tolist()
        assert pickle.loads(pickle.dumps(ray)).intersects_id(*rays)[0].tolist() == tri.tolist()


@pytest.mark.parametrize("seed", [4, 5], ids="seed{}".format)
def test_a_place_is_named_once_however_many_triangles_meet_there(seed: int) -> None:
    """Rays from inside a ball aim at vertices, at midpoints of edges and at points in faces."""
    mesh = trimesh.creation.icosphere(subdivisions=2)
    rng = np.random.default_rng(seed)
    weights = np.concatenate([np.eye(3), (1 - np.eye(3)) / 2, rng.dirichlet((1, 1, 1), 3)])
    aims = np.einsum("kc,fcd->fkd", weights, mesh.triangles).reshape(-1, 3)
    with RayMeshIntersector(mesh, "bvh-threaded", coincident=False) as ray:
        tri, index = ray.intersects_id(np.zeros_like(aims), aims)
        _, there, first = ray.intersects_location(np.zeros_like(aims), aims)
        ray.coincident = True
        _, all_of = ray.intersects_id(np.zeros_like(aims), aims)
    assert (index == np.arange(len(aims))).all() and (there == index).all()
    assert (tri == first).all() and len(all_of) > 2 * len(aims)


@pytest.mark.parametrize("away", [0.3, 4.0, 8.0])
@pytest.mark.parametrize("seed", [6, 7], ids="seed{}".format)
@pytest.mark.parametrize("shape", ["ball", "box"])
def test_queries_name_the_same_first_triangle(shape: str, seed: int, away: float) -> None:
    """All queries report the same first triangle. At a vertex, float32 may find triangles that the
    ray misses in float64; these triangles count too. If an origin is far, rounding to the
    caller's units can make different t equal."""
    mesh, rng = closed(shape), np.random.default_rng(seed)
    aims = np.tile(mesh.vertices, (2000 // len(mesh.vertices), 1))
    origins = rng.normal(size=aims.shape)
    origins *= away / np.linalg.norm(origins, axis=1, keepdims=True)
    rays = origins, aims - origins
    with RayMeshIntersector(mesh) as ray:
        first = ray.intersects_first(*rays)
        assert (first >= 0).sum() > 900
        nearest = *ray.intersects_id(*rays, max_hits=1), *ray.intersects_location(
            *rays, max_hits=1)[:0:-1]
        assert all((tri == first[first >= 0]).all() for tri in nearest[::2])
        assert all((index == np.flatnonzero(first >= 0)).all() for index in nearest[1::2])
        tri, index = ray.intersects_id(*rays)
        assert (tri[np.flatnonzero(np.diff(index, prepend=-1))] == first[first >= 0]).all()
        if away < 1:        # the places of a ray from inside lie far apart
            _, index, tri = ray.intersects_location(*rays)
            assert (tri[np.flatnonzero(np.diff(index, prepend=-1))] == first).all()


@pytest.mark.parametrize("name", OURS)
def test_a_mesh_far_from_the_origin(name: str) -> None:
    near, far = closed("tube"), closed("tube")
    away = np.array([4e6, 0, -2e5])
    far.apply_translation(away)
    origins, directions = random_rays(near, 100, 4)
    expected = ENGINES[name](near).intersects_location(origins, directions)
    found = ENGINES[name](far).intersects_location(origins + away, directions)
    assert found[1].tolist() == expected[1].tolist()
    assert found[2].tolist() == expected[2].tolist()
    assert np.abs(found[0] - away - expected[0]).max() < 1e-8     # adding `away` rounds vertices


def test_a_mesh_that_changes_is_noticed() -> None:
    mesh = closed("ball")
    with RayMeshIntersector(mesh, "kd-restart") as ray:
        down = [[0.05, 0.02, 9]], [[0, 0, -1]]
        before = ray.intersects_location(*down)[0][:, 2]
        tracer = ray._current()
        assert ray._current() is tracer
        mesh.apply_scale(2)
        after = ray.intersects_location(*down, multiple_hits=False)[0][:, 2]
        assert ray._current() is tracer and np.allclose(after, 2 * before.max(), rtol=0.02)
        top = int(ray.intersects_first(*down)[0])
        mesh.update_faces(np.arange(len(mesh.faces)) != top)
        assert ray.intersects_id(*down)[0].tolist() != [top]
        assert len(ray.intersects_id(*down)[0]) == 1 and ray._current() is not tracer


def test_copies_and_pickles() -> None:
    mesh = closed("box")
    mesh.ray = RayMeshIntersector(mesh, "grid", schedule="step")
    rays = random_rays(mesh, 20, 5)
    expected = mesh.ray.intersects_first(*rays).tolist()
    for other in (pickle.loads(pickle.dumps(mesh.ray)), copy.copy(mesh.ray),
                  copy.deepcopy(mesh.ray)):
        assert other.method == "grid" and other.options == {"schedule": "step"}
        assert other.intersects_first(*rays).tolist() == expected
    assert mesh.contains([[0, 0, 0], [3, 0, 0]]).tolist() == [True, False]
    with pytest.raises(rt.OptionError, match="no option"):
        RayMeshIntersector(mesh, "grid", nonsense=1).intersects_any(*rays)


def test_empty_invalid_and_mismatched_arrays(exact) -> None:
    """Queries accept empty arrays and invalid rays, and refuse arrays of different lengths."""
    mesh = closed("box")
    ray = exact(mesh)
    nothing = np.zeros((0, 3))
    if not isinstance(ray, Native):  # trimesh's engine fails without rays
        assert [len(a) for a in ray.intersects_id(nothing, nothing, return_locations=True)] \
            == [0, 0, 0]
        assert ray.intersects_first(nothing, nothing).shape == (0,)
        with pytest.raises(ValueError, match="differ"):
            ray.intersects_any(np.zeros((2, 3)), np.zeros((1, 3)))
        assert ray.intersects_first([[0, 0, np.nan], [0, 0, 0]], [[0, 0, 1.0], [0, 0, 0]]
                                    ).tolist() == [-1, -1]
    missing = ray.intersects_location([[9, 9, 9], [8, 8, 8]], [[1, 0, 0], [0, 1, 0]])
    assert [len(a) for a in missing] == [0, 0, 0]


@pytest.mark.parametrize("rays", [np.ones((2, 2, 3)), np.ones((2, 2)), np.ones(3), None, "ab"])
def test_arrays_of_other_shapes_are_refused(rays) -> None:
    with RayMeshIntersector(trimesh.creation.box()) as ray:
        for ask in (ray.intersects_location, ray.intersects_id, ray.intersects_first,
                    ray.intersects_any):
            with pytest.raises(ValueError, match="ray_origins .*give an array .n, 3."):
                ask(rays, rays)
            assert len(ask([], [])[0] if ask in (
                ray.intersects_location, ray.intersects_id) else ask([], [])) == 0


def test_a_stopped_ray_is_not_a_miss() -> None:
    """If a step cap stops a ray, a query raises an error and does not report a miss."""
    ray = RayMeshIntersector(closed("ball"), "kd-restart", step_cap=2)
    rays = random_rays(ray.mesh, 30, 6)
    for ask in (ray.intersects_id, ray.intersects_first, ray.intersects_any):
        with pytest.raises(rt.Error, match="step_cap"):
            ask(*rays)


@pytest.mark.parametrize("method, options", [("nosuch", {}), ("kd-restart", {"octants": True})])
def test_mistakes_show_at_once(method: str, options: dict) -> None:
    """Unknown methods and options are refused when the intersector is made."""
    with pytest.raises(rt.Error):
        RayMeshIntersector(trimesh.creation.box(), method, **options)


@pytest.mark.parametrize("given, advice", [
    ("box.stl", r"not the text 'box.stl'; give it trimesh.load_mesh\('box.stl'\)"),
    (Path("box.stl"), r"give it trimesh.load_mesh\('box.stl'\)"),
    (trimesh.Scene(), r"not a Scene; give it scene.to_mesh\(\)"),
    (None, r"not a NoneType; give it trimesh.Trimesh\(vertices, faces\)")])
def test_an_argument_that_is_no_mesh_is_refused_at_once(given: object, advice: str) -> None:
    with pytest.raises(ValueError, match=advice):
        RayMeshIntersector(given)


def test_only_vertices_of_faces_must_be_finite() -> None:
    mesh = closed("ball")
    mesh.vertices[7] = np.nan
    with pytest.raises(rt.SceneError, match="vertex 7 is .nan, nan, nan., not finite"):
        RayMeshIntersector(mesh)
    mesh.update_faces((mesh.faces != 7).all(axis=1))
    with RayMeshIntersector(mesh) as ray:
        down = ray.intersects_location([[0.05, 0.02, 9]], [[0, 0, -1]])
        ray.mesh.remove_unreferenced_vertices()
        again = ray.intersects_location([[0.05, 0.02, 9]], [[0, 0, -1]])
    assert len(down[0]) == 2 and all((a == b).all() for a, b in zip(down, again))


def test_an_invalid_ray_hits_nothing_in_every_query() -> None:
    origins = np.array([[0, 0, 5], [np.nan, 0, 5], [0, 0, np.inf], [0, 0, 5], [0, 0, 5.0]])
    directions = np.array([[0, 0, -1], [0, 0, -1], [0, 0, -1], [0, np.nan, -1], [0, 0, 0.0]])
    with RayMeshIntersector(closed("box")) as ray:
        assert ray.intersects_any(origins, directions).tolist() == [True] + [False] * 4
        assert (ray.intersects_first(origins, directions) >= 0).tolist() == [True] + [False] * 4
        assert set(ray.intersects_id(origins, directions)[1].tolist()) == {0}
        assert set(ray.intersects_location(origins, directions)[1].tolist()) == {0}
    for text in (RayMeshIntersector.__doc__, PAGE.read_text()):
        assert "a NaN, an infinity or a zero direction" in " ".join(text.split())
