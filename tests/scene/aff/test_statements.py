"""Each statement of AFF gives the triangles, material, light or camera that it describes."""
from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.scene import mesh_file
from gpgpu_rt.scene.mesh import Mesh

TRIANGLE = "p 3  0 0 0  1 0 0  0 1 0\n"


@pytest.fixture
def read(tmp_path: Path):
    def of(text: str, **others: str) -> Mesh:
        for name, content in {"a": text, **others}.items():
            (tmp_path / f"{name}.aff").write_text(content)
        return mesh_file.read(tmp_path / "a.aff")
    return of


def test_polygons(read) -> None:
    mesh = read("p 4 0 0 0 1 0 0 1 1 0 0 1 0 p 5 0 0 1 1 0 1 2 1 1 1 2 1 0 2 1\n" + TRIANGLE)
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0], [4, 5, 6], [4, 6, 7], [4, 7, 8],
                                   [9, 10, 11]]
    assert mesh.vertices.shape == (12, 3) and mesh.vertices[8].tolist() == [0, 2, 1]
    assert mesh.normals is None and mesh.uv is None


def test_polygons_with_normals(read) -> None:
    mesh = read(TRIANGLE + "pp 3 0 0 0 0 0 2 1 0 0 1 0 0 0 1 0 0 1 0")
    assert mesh.normals[1].tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    assert mesh.normals[0].tolist() == [[0, 0, 1]] * 3      # the triangle without given normals


MESH = """m vertices 4  0 0 0  1 0 0  1 1 0  0 1 0
normals 2  0 0 1  0 1 0
texturecoords 3 wood.ppm  0 0  1 0.25  0.5 1
triangles 2
0 1 2  0 0 1  0 1 2
2 3 0  1 1 1  2 2 0
"""


def test_meshes(read, tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "wood.ppm")
    mesh = read("fm 0 0 0 0.5 0.4 0.3 0.1 0.1 0.1 20 0 0\n" + MESH)
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert mesh.normals[0].tolist() == [[0, 0, 1], [0, 0, 1], [0, 1, 0]]
    assert mesh.uv[0].tolist() == [[0, 1], [1, 0.75], [0.5, 0]]     # v points up
    material, = mesh.materials
    assert material.texture.texels.shape == (2, 2, 3) and material.diffuse == (0.5, 0.4, 0.3)


@pytest.mark.parametrize("folder", [None, "../TextureFiles", "elsewhere"])
def test_a_missing_texture_gives_a_warning(folder: str | None, tmp_path: Path) -> None:
    """A texture may lie in ../TextureFiles. A missing texture gives a warning of one line."""
    place = tmp_path / "aff"
    place.mkdir()
    (place / "a.aff").write_text("fm 0 0 0 0.5 0.4 0.3 0 0 0 20 0 0\n" + MESH)
    if folder is not None:
        (place / folder).mkdir()
        Image.new("RGB", (2, 2)).save(place / folder / "wood.ppm")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        scene = rt.load_scene(place / "a.aff")
    found = scene.materials[0].texture is not None
    assert found == (folder == "../TextureFiles") and (len(said) == 0) == found
    assert scene.colours[0].tolist() == pytest.approx([0.5, 0.4, 0.3])
    if not found:
        assert "no texture wood.ppm" in str(said[0].message)
        assert str(said[0].message).count("\n") == 0


def test_a_texture_outside_is_not_read(read, tmp_path: Path) -> None:
    Image.new("RGB", (2, 2)).save(tmp_path.parent / "outside.ppm")
    with pytest.warns(UserWarning, match="no texture"):
        mesh = read(MESH.replace("wood.ppm", "../outside.ppm"))
    assert mesh.materials[0].texture is None


def test_meshes_without_normals_or_coordinates(read) -> None:
    mesh = read("m vertices 3 0 0 0 1 0 0 0 1 0 triangles 1 2 1 0\n"
                "m vertices 3 0 0 1 1 0 1 0 1 1 texturecoords 0 no.ppm triangles 1 0 1 2\n"
                "m vertices 3 0 0 2 1 0 2 0 1 2 normals 0 triangles 1 0 1 2")
    assert mesh.faces.tolist() == [[2, 1, 0], [3, 4, 5], [6, 7, 8]]
    assert mesh.uv is None and mesh.normals is None


def test_textured_triangles(read, tmp_path: Path) -> None:
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    Image.new("RGB", (4, 4)).save(tmp_path / "b.png")
    flat = "tt {} 0 0 0 0 0  1 0 0 1 0  0 1 0 0 1\n"
    patch = "ttp b.png 0 0 0 0 1 0 0 0  1 0 0 0 1 0 1 0  0 1 0 0 1 0 0 1\n"
    mesh = read(flat.format("a.png") * 2 + flat.format("b.png") + patch * 2)
    assert len(mesh.faces) == 5 and len(mesh.materials) == 2
    assert mesh.material_of.tolist() == [0, 0, 1, 1, 1]
    assert mesh.uv[:, 1].tolist() == [[1, 1]] * 5
    assert mesh.normals[4].tolist() == [[0, 1, 0]] * 3


def test_spheres_and_cones(read) -> None:
    mesh = read("xs 1 1 1 0 0 1 0 5 0 0 { s 1 2 3 0.5 }\nc 0 0 0 1  0 0 2 1\nc 0 0 0 1 0 3 0 0")
    ball = mesh.vertices[mesh.faces[mesh.part_of == 0]]
    count = len(mesh.faces) - 48 - 24    # the second cone ends in a tip
    distance = np.linalg.norm(mesh.vertices[:3 * count] - (6, 2, 3), axis=1)
    np.testing.assert_allclose(distance, 0.5, atol=1e-6)
    normal = np.cross(ball[:, 1] - ball[:, 0], ball[:, 2] - ball[:, 0])
    middle = ball.mean(axis=1)
    assert count == 1258 and ((normal * (middle - (6, 2, 3))).sum(axis=1)[:count] > 0).all()
    pipe = slice(count, count + 48)
    np.testing.assert_allclose(np.linalg.norm(ball[pipe, :, :2], axis=2), 1, atol=1e-6)
    assert ((normal * middle)[pipe, :2].sum(axis=1) > 0).all()


@pytest.mark.parametrize("text, part, value", [
    ("f 1 0.5 0 0.6 0.3 20 0 0", "diffuse", (0.6, 0.3, 0)),
    ("f 1 0.5 0 0.6 0.3 20 0 0", "mirror", (0.3, 0.3, 0.3)),
    ("fm 1 1 1 0.8 0.1 0 0.5 0.5 0.5 20 0.1 0", "diffuse", (0.8, 0.1, 0)),
    ("fm 1 1 1 0.8 0.1 0 0.5 0.5 0.5 20 0.1 0", "mirror", (0.2, 0.5, 0.5)),
    ("fm 1 1 1 0.8 0.1 0 0.5 0.5 0.5 20 0.1 0", "ior", None),
    ("fm 0.1 0.1 0.1 0.2 0.2 0.2 0.1 0.1 0.1 20 0.85 1.55", "ior", 1.55),
    ("fm 0.1 0.1 0.1 0.2 0.2 0.2 0.1 0.1 0.1 20 0.85 1.55", "diffuse", (0, 0, 0)),
    ("fm 0.1 0.1 0.1 0.2 0.2 0.2 0.1 0.1 0.1 20 1 0", "ior", 1),
    ("fm 0.4 0.3 0.2 0 0 0 0 0 0 0 0 0", "diffuse", (0.4, 0.3, 0.2)),
    ("fm 2 2 2 -1 7 0.5 9 0 -2 0 0 0", "diffuse", (0, 1, 0.5)),
    ("fm 2 2 2 -1 7 0.5 9 0 -2 0 0 0", "mirror", (1, 0, 0)),
    ("", "diffuse", rt.Material().diffuse)])
def test_fills(text: str, part: str, value, read) -> None:
    material, = read(f"{text}\n{TRIANGLE}").materials
    assert getattr(material, part) == (value if value is None else pytest.approx(value))


def test_a_fill_lasts_across_blocks_and_files(read) -> None:
    red, blue = "f 1 0 0 1 0 0 0 0\n", "f 0 0 1 1 0 0 0 0\n"
    mesh = read(f"i 0 paint.aff\n{TRIANGLE} xs 1 1 1 0 0 1 0 0 0 0 {{ {blue} {TRIANGLE} }}"
                f"{TRIANGLE} i 0 part.aff", paint=red, part=TRIANGLE)
    assert mesh.colours.tolist() == [[1, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 1]]
    assert [m.name for m in mesh.materials] == ["paint", "a"]
    assert mesh.parts == ("a", "part") and mesh.part_of.tolist() == [0, 0, 0, 1]


def test_transforms_scale_then_turn_then_move(read) -> None:
    mesh = read(f"xs 2 1 1  0 0 3 90  0 0 7 {{ xs 1 1 1 0 0 1 0 10 0 0 {{ {TRIANGLE} }} }}"
                + TRIANGLE)
    np.testing.assert_allclose(mesh.vertices, [(0, 20, 7), (0, 22, 7), (-1, 20, 7), (0, 0, 0),
                                               (1, 0, 0), (0, 1, 0)], atol=1e-14)


@pytest.mark.parametrize("scale", [(2, 1, 1), (-1, 1, 1), (1, 1, 0), (0, 0, 0)])
def test_normals_stay_at_right_angles(scale, read) -> None:
    """If a plane with the normal (1, 1, 0) is scaled, its normal stays perpendicular to the plane,
    even if the scale flattens the plane."""
    mesh = read("xs {} {} {} 0 0 1 0 0 0 0 {{".format(*scale)
                + "pp 3 1 -1 0 1 1 0  -1 1 0 1 1 0  0 0 1 1 1 0 }" + TRIANGLE)
    a, b, c = mesh.vertices[:3]
    normal = mesh.normals[0, 0]
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert [normal @ (b - a), normal @ (c - a)] == pytest.approx([0, 0])
    if scale[0] * scale[2]:
        assert normal @ (scale * np.array([1, 1, 0])) > 0


def test_the_camera_lights_and_background(read, tmp_path: Path) -> None:
    text = ("v from 1 2 3 at 1 2 0 up 0 1 0 angle 40 hither 1 resolution 512 512\n"
            "b 0.1 0.2 0.3\nam 1 1 1\nl 1 5 1\nl 2 5 2 0.5 0.4 0.3\nla lamp 3 5 3 1 0 0\n")
    mesh = read(text + TRIANGLE)
    assert mesh.camera == rt.Camera((1, 2, 3), (1, 2, 0), fov=40)
    assert [(light.position, light.intensity) for light in mesh.lights] == [
        ((1, 5, 1), (1, 1, 1)), ((2, 5, 2), (0.5, 0.4, 0.3)), ((3, 5, 3), (1, 0, 0))]
    scene = rt.load_scene(tmp_path / "a.aff")
    assert scene.camera == mesh.camera and scene.lights == mesh.lights
    assert scene.environment == rt.Environment.constant((0.1, 0.2, 0.3))
    (tmp_path / "cameras.json").write_text('{"a": {"eye": [0, 0, 9], "target": [0, 0, 0]}}')
    assert rt.load_scene(tmp_path / "a.aff").camera.eye == (0, 0, 9)


def test_without_a_camera_light_and_background(read, tmp_path: Path) -> None:
    mesh = read(TRIANGLE)
    assert mesh.camera is None and mesh.lights == () and mesh.environment is None
    scene = rt.load_scene(tmp_path / "a.aff")
    assert len(scene.lights) == 1 and scene.environment.kind == "backdrop"


KEYS = "transl 4 -1 0 0 5 0 0 0  0 0 0 5 0 0 0  1 3 0 5 0 0 0  2 3 0 5 0 0 0\n"
TURN = "rot 4 -1 0 1 0 90 0 0 0  0 0 1 0 90 0 0 0  1 0 1 0 0 0 0 0  2 0 1 0 0 0 0 0\n"


def test_key_frames_move_the_camera(read) -> None:
    """The camera looks along the negative z-axis of its key frames."""
    view = "v from 1 2 3 at 1 2 0 up 0 1 0 angle 40 hither 1 resolution 512 512\n"
    for text, eye, target, fov in (
            (view + f"k camera {{ {KEYS} {TURN} }}", (0, 0, 5), (-1, 0, 5), 40),
            (view + f"k camera {{ {KEYS} }}", (0, 0, 5), (0, 0, 2), 40),
            (view + f"k camera {{ {TURN} }}", (1, 2, 3), (0, 2, 3), 40),
            (f"k camera {{ {TURN} {KEYS} }} ", (0, 0, 5), (-1, 0, 5), 45)):
        camera = read(text + TRIANGLE).camera
        np.testing.assert_allclose([camera.eye, camera.target], [eye, target], atol=1e-14)
        assert camera.fov == fov
    assert read(f"k camera {{ {KEYS} }}" + TRIANGLE).camera is None


def test_a_named_transform_moves_by_its_key_frames(read) -> None:
    """Key frames may be anywhere in the file. If several statements ``k`` have the same name, the
    last statement applies. A transform without key frames does not move. The mesh shows the start
    of the animation."""
    other = KEYS.replace(" 5 0 0 0", " 9 0 0 0")
    block = f"x part {{ {TRIANGLE} x still {{ {TRIANGLE} }} }}\n"
    mesh = read(f"k part {{ {other} }} {block} k part {{ {KEYS} }}")
    assert mesh.vertices[[0, 3]].tolist() == [[0, 0, 5], [0, 0, 5]]
    mesh = read(f"a 1 2 3\n{block} k part {{ {KEYS} }}")
    assert mesh.vertices[[0, 3]].tolist() == [[3, 0, 5], [3, 0, 5]]


def test_hidden_parts_have_no_area(read) -> None:
    mesh = read(f"x part {{ x inner {{ {TRIANGLE} }} }} {TRIANGLE}"
                "k part { visibility 2 -1 0 5 1 }")
    assert np.ptp(mesh.vertices[:3], axis=0).tolist() == [0, 0, 0]
    assert np.ptp(mesh.vertices[3:], axis=0).tolist() == [1, 1, 0]


def test_animated_triangles(read) -> None:
    corner = "{0} 0 0 0 0 1  {0} 1 0 0 0 1  {0} 0 1 0 0 1"
    for start, x in ((0, 2), (2, 2), (3, 4), (4, 6), (9, 6)):
        mesh = read(f"a {start} 10 5 tpa 2 2 {corner.format(2)} 4 {corner.format(6)}")
        assert mesh.vertices[:, 0].tolist() == [x] * 3
    assert mesh.normals[0].tolist() == [[0, 0, 1]] * 3
    assert read(f"tpa 1 2 {corner.format(2)}").vertices[:, 0].tolist() == [2] * 3


def test_details(read) -> None:
    text = "i 0 b.aff d 2 i 2 b.aff i 3 gone.aff d 0 i 1 gone.aff"
    assert len(read(text, b=TRIANGLE).faces) == 2


@pytest.mark.parametrize("text", [
    "# all\n% of it\n" + TRIANGLE, "p 3#three\r\n0 0 0 % one\r\n1 0 0\r0 1 0",
    "xs 1 1 1 0 0 1 0 0 0 0{" + TRIANGLE + "}",
    "p 3 # three\r0 0 0 1 0 0 0 1 0", "\tp\n3\n0 0 0 1 0 0 0 1 0 # caf\u00e9"])
def test_spaces_and_comments(text: str, read) -> None:
    assert read(text).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_bytes_that_are_no_utf8(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_bytes(TRIANGLE.encode() + b"# f\xf6rslag\n")
    assert len(mesh_file.read(tmp_path / "a.aff").faces) == 1
