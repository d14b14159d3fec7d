"""Catalogue scenes have the right counts, names and files, and defective meshes are refused."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.scene import catalogue
from gpgpu_rt.scene.loading import list_scenes, scene_names

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(autouse=True)
def no_meshes(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.full if catalogue.ROWS[name].triangles > 10**6 else ())
    for name in scene_names() if catalogue.ROWS[name].make])
def test_built_scenes(name: str) -> None:
    """A built scene has as many triangles as the catalogue says, and is the same each time."""
    scene, row = rt.load_scene(name), catalogue.ROWS[name]
    assert len(scene) == row.triangles and scene.stand_in == row.stand_in
    assert np.isfinite(scene.triangles).all() and scene.extent > 0
    assert scene.colours.shape == (len(scene), 3) and scene.colours.max() <= 1
    again = rt.load_scene(name)
    assert (again.triangles == scene.triangles).all()
    if len(scene) <= 10**6:  # test_large.py tests larger scenes
        hits = rt.reference.trace(scene, *scene.camera.rays((12, 12)), accelerated=True)
        assert hits.hit.mean() > 0.15  # the camera sees the scene


@pytest.mark.parametrize("name", ["robots-moving", "kitchen-moving"])
def test_a_scene_without_its_file(name: str, capsys) -> None:
    """If the file of a scene is missing, the error says how to get it. The list of scenes names
    the scene and prints nothing to standard error."""
    for load in (rt.load_scene, rt.load_animation):
        with pytest.raises(rt.SceneError, match=f"--fetch {name.split('-')[0]}`$") as caught:
            load(name)
        assert "\n" not in str(caught.value)
    row = next(r for r in list_scenes() if r["name"] == name)
    assert row["found"] == "missing" and row["triangles"] == catalogue.ROWS[name].triangles
    assert main(["scenes"]) == 0
    said = capsys.readouterr()
    assert f"{name} " in said.out and not said.err


def test_stadium_ratio() -> None:
    small, large = rt.load_scene("stadium:0.5"), rt.load_scene("stadium:1e-3")
    assert len(small) == len(large) and large.extent > 300 * small.extent
    for bad in ("stadium:0", "stadium:two", "stadium:-1", "stadium:5"):
        with pytest.raises(rt.SceneError, match="ratio"):
            rt.load_scene(bad)


def test_meshes_in_folders_come_first(monkeypatch, tmp_path) -> None:
    """A mesh in a folder of GPGPU_RT_SCENES replaces the built-in scene of the same name."""
    trimesh.Trimesh(SQUARE, FACES, process=False).export(tmp_path / "bunny.ply")
    (tmp_path / "cameras.json").write_text(
        '{"bunny": {"eye": [0, 0, 9], "target": [0, 0, 0], "fov_degrees": 30}}')
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path))
    scene = rt.load_scene("bunny")
    assert len(scene) == 2 and scene.stand_in is None and scene.camera.fov == 30
    row = next(r for r in list_scenes() if r["name"] == "bunny")
    assert row["triangles"] == 2 and row["found"].endswith("bunny.ply")
    (tmp_path / "cameras.json").write_text("{")
    with pytest.raises(rt.SceneError, match="not readable as JSON"):
        rt.load_scene("bunny")


@pytest.mark.parametrize("suffix", ["ply", "obj", "stl", "glb", "off"])
def test_files_keep_their_faces(suffix: str, tmp_path) -> None:
    rng = np.random.default_rng(2)
    vertices, faces = rng.normal(size=(30, 3)).astype(np.float32), rng.permutation(30)
    mesh = trimesh.Trimesh(vertices, faces.reshape(-1, 3), process=False)
    mesh.export(tmp_path / f"m.{suffix}")
    scene = rt.load_scene(tmp_path / f"m.{suffix}")
    np.testing.assert_allclose(scene.triangles, vertices[faces.reshape(-1, 3)], atol=1e-6)


def test_trimesh_is_a_scene() -> None:
    scene = rt.load_scene(trimesh.creation.box())
    assert len(scene) == 12 and rt.load_scene(scene) is scene
    moved = trimesh.Scene()
    moved.add_geometry(trimesh.creation.box(),
                       transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    assert rt.load_scene(moved).bounds[0][0] == 4.5


@pytest.mark.parametrize("vertices, faces, message", [
    ([[0, 0, 0], [1, 0, np.nan], [0, 1, 0]], [[0, 1, 2]], "vertex 1 "),
    ([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], [[0, 1, 2]], "vertex 2 "),
    ([[0, 0, 0], [1e39, 0, 0], [0, 1, 0]], [[0, 1, 2]], "vertex 1 "),
    (SQUARE, [[0, 1, 2], [0, 2, 4]], "face 1 "),
    (SQUARE, [[0, 1, -1]], "face 0 "),
    (SQUARE, [[0, 1]], "shape"),
    (SQUARE[:, :2], FACES, "shape"),
    (SQUARE, [[0.5, 1, 2]], "whole numbers"),
    ("abc", FACES, "array of numbers"),
    (SQUARE * 1j, FACES, "array of numbers"),
])
def test_broken_arrays(vertices, faces, message: str) -> None:
    with pytest.raises(rt.SceneError, match=message) as caught:
        rt.Scene.from_arrays(vertices, faces)
    assert "\n" not in str(caught.value)


def test_broken_files(tmp_path) -> None:
    trimesh.Trimesh(SQUARE, FACES, process=False).export(tmp_path / "cut.ply")
    whole = (tmp_path / "cut.ply").read_bytes()
    (tmp_path / "cut.ply").write_bytes(whole[:-20])
    (tmp_path / "noise.glb").write_bytes(bytes(range(256)))
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    for name, message in (("cut.ply", "cannot read"), ("noise.glb", "cannot read"),
                          ("gone.obj", "no such file"), ("nan.obj", r"nan\.obj: vertex 2")):
        with pytest.raises(rt.SceneError, match=message) as caught:
            rt.load_scene(tmp_path / name)
        assert "\n" not in str(caught.value)


def test_unknown_names() -> None:
    with pytest.raises(rt.SceneError, match="did you mean kitchen"):
        rt.load_scene("kichen")
    with pytest.raises(rt.SceneError, match="no scene is named"):
        rt.load_scene("")
    with pytest.raises(rt.SceneError, match="no scene"):
        rt.load_scene("a" * 5000)
    with pytest.raises(rt.SceneError, match="int"):
        rt.load_scene(7)


@pytest.mark.parametrize("changes, message", [
    (dict(target=(0, 0, 0)), "coincide|both"), (dict(up=(0, 0, 1)), "parallel"),
    (dict(fov=0), "fov"), (dict(fov=180), "fov"), (dict(eye=(0, 0)), "three numbers"),
    (dict(eye=(0, np.nan, 0)), "finite")])
def test_cameras_are_checked(changes: dict, message: str) -> None:
    good = dict(eye=(0, 0, 0), target=(0, 0, -1), up=(0, 1, 0), fov=45)
    with pytest.raises(rt.SceneError, match=message):
        rt.Camera(**{**good, **changes})


def test_camera_rays() -> None:
    camera = rt.Camera((1, 2, 3), (1, 2, -7), fov=90)
    origins, directions = camera.rays((2, 2))
    assert (origins == np.float32([1, 2, 3])).all()
    expected = np.array([-0.5, 0.5, -1]) / np.sqrt(1.5)  # row 0 is the top
    np.testing.assert_allclose(directions[0, 0], expected, atol=1e-7)
