"""Truncated mesh files are refused, and faces keep the file's order even if their materials
differ."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.scene.mesh_file import read

KINDS = {"ply": {}, "ascii ply": {"encoding": "ascii"}, "stl": {}, "stl_ascii": {}, "glb": {}}


@pytest.mark.parametrize("kind", KINDS)
def test_cut_files_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"m.{kind.split()[-1].split('_')[0]}"
    mesh = trimesh.creation.icosphere(subdivisions=1)
    mesh.export(path, file_type=kind.split()[-1], **KINDS[kind])
    whole = path.read_bytes().rstrip(b"\n") if "ascii" in kind else path.read_bytes()
    assert len(rt.load_scene(path)) == 80
    # An ASCII file that loses a digit of its last number is still valid, so cut a whole line.
    most = whole.rindex(b"\n") if "ascii" in kind else len(whole) - 1
    for length in (0, 1, 61, 83, 84, len(whole) // 3, len(whole) // 2, most):
        path.write_bytes(whole[:length])
        with pytest.raises(rt.SceneError, match="cannot read this mesh") as caught:
            rt.load_scene(path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name, why", [("README.md", "no mesh format has this suffix"),
                                       ("m", "no suffix")])
def test_the_formats_of_meshes_are_named(name: str, why: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("# A page\n")
    with pytest.raises(rt.SceneError, match=f": {why}; give .ply, .obj,"):
        rt.load_scene(tmp_path / name)


def test_an_stl_that_begins_with_solid_may_be_binary(tmp_path: Path) -> None:
    path = tmp_path / "m.stl"
    trimesh.creation.icosphere(subdivisions=1).export(path)
    path.write_bytes(b"solid" + path.read_bytes()[5:])
    assert len(rt.load_scene(path)) == 80


def test_obj_faces_keep_their_order_and_material(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n")
    corners = "".join(f"v {i} {i * i % 7} {i % 3}\n" for i in range(12))
    (tmp_path / "m.obj").write_text(
        f"mtllib m.mtl\n{corners}usemtl red\nf 1 2 3\nusemtl green\nf 4 5 6\n"
        "usemtl red\nf 7 8 9\nf 12 11 10\n")
    scene = rt.load_scene(tmp_path / "m.obj")
    assert scene.triangles[:, :, 0].tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8], [11, 10, 9]]
    assert scene.colours[:, 1].tolist() == [0, 1, 0, 0]


def test_instances_are_placed_one_after_another(tmp_path: Path) -> None:
    """Two instances of a mesh become two copies of its triangles, each at its own place."""
    scene, box = trimesh.Scene(), trimesh.creation.box()
    for x in (0.0, 5.0):
        scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([x, 0, 0]))
    scene.export(tmp_path / "two.glb")
    loaded = rt.load_scene(tmp_path / "two.glb")
    assert len(loaded) == 24 and np.ptp(loaded.triangles[..., 0]) == 6


@pytest.mark.parametrize("kind", ["obj", "ply", "obj of lines"])
def test_meshes_without_faces_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"points.{kind.split()[0]}"
    if kind == "ply":
        trimesh.PointCloud(np.eye(3)).export(path)
    else:
        path.write_text({"obj": "v 0 0 0\nv 1 0 0\n",
                         "obj of lines": "v 0 0 0\nv 1 0 0\nl 1 2\nf 1 2\n"}[kind])
    with pytest.raises(rt.SceneError, match="no triangles"):
        rt.load_scene(path)


@pytest.mark.parametrize("text, message", [
    ("", "the file is empty"), ("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "vertex 1 "),
    ("v 0 0 0\nv 1 0 0\nv 0 1e39 0\nf 1 2 3\n", "vertex 2 "),
    ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot read")])
def test_broken_obj_files(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(text)
    with pytest.raises(rt.SceneError, match=message):
        rt.load_scene(tmp_path / "m.obj")


def test_vertices_are_not_dropped_on_the_way(tmp_path: Path) -> None:
    """Every vertex and face is kept. trimesh would drop a face with an invalid vertex and merge
    equal vertices."""
    broken = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0], [1, 1, 1], [0, 1, 0]])
    mesh = trimesh.Trimesh(broken, [[0, 1, 2], [3, 4, 5]], process=False)
    mesh.export(tmp_path / "m.ply")
    with pytest.raises(rt.SceneError, match="vertex 3 "):
        rt.load_scene(tmp_path / "m.ply")


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLACES = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
QUAD = "f 1/1 2/2 3/3 4/4\n"
TEXTURED = {
    "a quad": PLACES + "usemtl a\n" + QUAD,
    "a vertex that no face has": PLACES + "usemtl a\nf 1/1 2/2 4/4\n",
    "an untextured part first": "usemtl b\nf 1 2 3\n" + PLACES + "usemtl a\nf 4/4 1/1 2/2\n",
    "several materials": PLACES + "".join(f"usemtl {name}\n{QUAD}" for name in "abc"),
    "normals too": PLACES + "vn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/3/1 4/4/1\n",
}


@pytest.fixture
def textured(tmp_path: Path) -> Path:
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "a.png")
    (tmp_path / "m.mtl").write_text(
        "newmtl a\nmap_Kd a.png\nnewmtl b\nKd 0 1 0\nnewmtl c\nKd 0 0 1\n")
    return tmp_path / "m.obj"


def test_faces_without_texture_coordinates_get_none(textured: Path) -> None:
    """A face without texture coordinates gets none from other faces with the same vertices."""
    textured.write_text(f"mtllib m.mtl\n{SQUARE}{PLACES}usemtl a\no x\nf 1 2 3\no y\n{QUAD}")
    scene = rt.load_scene(textured)
    assert not scene.uv[0].any() and np.array_equal(scene.uv[1:], scene.triangles[1:, :, :2])


def test_groups_keep_their_materials(textured: Path) -> None:
    for words, part in (("", "m.obj"), ("g x\n", "x"), ("o x\n", "x")):
        textured.write_text(f"mtllib m.mtl\n{SQUARE}{PLACES}{words}usemtl a\n{QUAD}usemtl b\n"
                            f"{QUAD}{words.replace('x', 'y')}usemtl a\nf 1 2 3\n")
        mesh = read(textured, groups=True)
        names = [mesh.parts[k] for k in mesh.part_of]
        assert names == [part] * 4 + ["y" if words else part]
        assert [mesh.materials[k].name for k in mesh.material_of] == list("aabba")
        places = mesh.vertices[mesh.faces][..., :2]
        assert np.array_equal(mesh.uv[:4], places[:4]) and not mesh.uv[4].any()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", TEXTURED)
def test_corners_of_textured_obj_files_keep_their_coordinates(name: str, textured: Path) -> None:
    """Each corner keeps its own texture coordinates."""
    textured.write_text("mtllib m.mtl\n" + SQUARE + TEXTURED[name])
    scene = rt.load_scene(textured)
    places = scene.triangles[..., :2].copy()
    if "first" in name:
        assert scene.material_of.tolist() == [0, 1]
        places[0] = 0
    assert np.array_equal(scene.uv, places)  # uv equals x and y in SQUARE
    assert scene.normals is None or (scene.normals == (0, 0, 1)).all()
    assert (scene.normals is not None) == (name == "normals too")
