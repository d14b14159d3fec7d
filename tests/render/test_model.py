"""Materials, lights and corner attributes are kept as given, or refused with an error of one
line."""
from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.scene.attributes import smooth_normals
from gpgpu_rt.scene.light import BACKDROP, Environment, PointLight
from gpgpu_rt.scene.material import GREY, Material
from gpgpu_rt.scene.texture import Texture

VERTICES, FACES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), [[0, 1, 2], [0, 2, 3]]


def scene(**appearance: object) -> rt.Scene:
    return rt.Scene.from_arrays(VERTICES, FACES, name="two", **appearance)


def test_a_bare_mesh_is_diffuse_grey_before_a_backdrop() -> None:
    bare = scene()
    assert bare.materials == (Material(),) and bare.environment is BACKDROP
    assert (bare.colours == np.float32(GREY)).all() and not len(bare.emitters)
    assert bare.lights == (bare.light,)


def test_colours_equal_the_colours_of_the_materials() -> None:
    lamp = Material("lamp", emission=(3, 2, 1))
    two = scene(materials=[Material("red", (1, 0, 0)), lamp], material_of=[1, 0])
    assert two.colours.tolist() == [[0, 0, 0], [1, 0, 0]] and two.emitters.tolist() == [0]
    assert two.used_materials == two.materials
    assert scene(materials=[Material("red", (1, 0, 0)), lamp]).used_materials[0].name == "red"


BAD = {
    "diffuse": (lambda: Material("a", diffuse=(2, 0, 0)), "material a: diffuse"),
    "mirror": (lambda: Material("a", mirror=(0, -1, 0)), "material a: mirror"),
    "shares": (lambda: Material("a", (0.5,) * 3, mirror=(0.6,) * 3), "material a: .* more than 1"),
    "dielectric": (lambda: Material("a", (0.1,) * 3, ior=1.5), "material a: a dielectric"),
    "ior": (lambda: Material("a", ior=-1.5), "material a: ior"),
    "roughness": (lambda: Material("a", glossy=(1, 1, 1), roughness=0), "material a: roughness"),
    "emission": (lambda: Material("a", emission=(1, np.nan, 1)), "material a: emission"),
    "texture": (lambda: Material("a", texture="wood.png"), "material a: texture"),
    "light": (lambda: PointLight((0, 0, 0), (-1, 0, 0)), "light: intensity"),
    "environment": (lambda: Environment.constant((-1, 0, 0)), "environment: zenith"),
    "kind": (lambda: Environment("fog"), "environment: kind"),
    "texture file": (lambda: Texture.load("no/such.png"), "no such texture"),
    "texels": (lambda: Texture("t", -np.ones((2, 2, 3))), "texture t: a texel is negative"),
    "rows": (lambda: scene(material_of=[0, 1]), "triangle 1 is of material 1"),
    "row shape": (lambda: scene(material_of=[0.5, 1]), "material_of has shape"),
    "normals": (lambda: scene(normals=[np.diag([1, 1, 0])] * 2), "triangle 0 has a normal"),
    "uv": (lambda: scene(uv=np.zeros((2, 3))), "uv have shape"),
    "no uv": (lambda: scene(materials=[Material("t", texture=Texture("t", np.ones((1, 1, 3))))]),
              "material t has a texture"),
}


@pytest.mark.parametrize("name", BAD)
def test_invalid_values_are_refused_in_one_line(name: str) -> None:
    make, message = BAD[name]
    with pytest.raises(rt.SceneError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_normals_of_a_sphere_point_outwards() -> None:
    ball = rt.load_scene("boulder")
    centred = ball.triangles / np.linalg.norm(ball.triangles, axis=2, keepdims=True)
    assert ((smooth_normals(centred) - centred) ** 2).sum(2).max() < 1e-3


def test_moved_triangles_have_new_normals() -> None:
    smooth = scene(normals=np.broadcast_to((0.0, 0.0, 1.0), (2, 3, 3)))
    moved = smooth.moved(VERTICES * (1, 1, -1))
    assert (moved.normals[0, 1] == (0, 0, 1)).all() and abs(moved.normals[1, 2, 0]) == 1


def test_textures_repeat_and_blend(tmp_path) -> None:
    Image.fromarray(np.uint8([[[0] * 3, [255] * 3], [[255] * 3, [0] * 3]])
                    ).save(tmp_path / "c.png")
    texture = Texture.load(tmp_path / "c.png")
    at = [(0.25, 0.75), (0.75, 0.75), (0.5, 0.5), (-0.75, 1.75), (0.75, 0.25)]
    assert texture.sample(at)[:, 0].tolist() == [0, 1, 0.5, 0, 0]


def test_the_ambient_term_is_the_irradiance_of_the_environment() -> None:
    """`ambient` agrees with a Monte Carlo estimate of the irradiance."""
    rng = np.random.default_rng(7)
    d = rng.normal(size=(200_000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    n = np.array([0.48, 0.6, 0.64])
    rows = 0.5 + 0.5 * np.sin(np.pi * (0.5 - (np.arange(64) + 0.5) / 64))
    image = np.broadcast_to(rows[:, None, None], (64, 128, 3))
    for surroundings in (Environment.sky((0.2, 0.5, 1), (0.3, 0.2, 0.1)),
                         Environment.constant((1, 2, 3)),
                         Environment.surrounded(Texture("ramp", image))):
        white = 4 * (surroundings.radiance(d) * np.maximum(d @ n, 0)[:, None]).mean(0)
        ambient = surroundings.ambient()
        assert np.abs(ambient[0] + n @ ambient[1:] - white).max() < 0.02
