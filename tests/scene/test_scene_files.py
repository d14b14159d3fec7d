"""A scene holds exactly the contents of its scene file, and invalid contents are refused in one
line."""
from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.render import images
from gpgpu_rt.scene.scene_keys import OBJECTS, schema
from gpgpu_rt.scene.texture import Texture

DOCS = Path(__file__).parents[2] / "docs"
GOOD: dict[str, Any] = {
    "name": "still",
    "materials": {"white": {"diffuse": [0.7, 0.7, 0.7]}, "glass": {"ior": 1.5},
                  "lamp": {"emission": [4, 4, 3]}, "wood": {"texture": "wood.png"}},
    "meshes": [
        {"quad": [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], "material": "wood"},
        {"sphere": {"centre": [0, 1, 0], "radius": 0.5}, "material": "glass", "smooth": True},
        {"box": {"lo": [0, 0, 0], "hi": [1, 1, 1]}, "scale": [1, 2, 3], "rotate": [0, 90, 0],
         "translate": [5, 0, 0], "material": "lamp"},
        {"file": "two.obj", "materials": {"left": "white"}}],
    "lights": [{"position": [0, 5, 0], "intensity": [1, 0.5, 0]}],
    "environment": {"zenith": [0, 0, 1], "ground": [1, 0, 0]},
    "camera": {"eye": [0, 1, 5], "target": [0, 1, 0]},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "wood.png")
    (tmp_path / "two.mtl").write_text("newmtl green\nKd 0 1 0\n")
    (tmp_path / "two.obj").write_text(
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl green\n"
        "g left\nf 1 2 3\ng right\nf 1 2 4\n")
    return tmp_path


def written(folder: Path, said: Any) -> Path:
    path = folder / "still.json"
    path.write_text(said if isinstance(said, str) else json.dumps(said))
    return path


def test_a_scene_file_is_read(folder: Path) -> None:
    scene = rt.load_scene(written(folder, GOOD))
    names = [scene.materials[row].name for row in scene.material_of]
    spheres = names.count("glass")
    assert names == ["wood"] * 2 + ["glass"] * spheres + ["lamp"] * 12 + ["white", "green"]
    assert 1000 < spheres <= 1280 and scene.name == "still"
    a, b, c = (scene.triangles[2:2 + spheres] - (0, 1, 0)).transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() / 6 > 0.5  # anticlockwise from outside
    box = scene.triangles[2 + spheres:14 + spheres].reshape(-1, 3)
    assert np.allclose([box.min(0), box.max(0)], [[5, 0, -1], [8, 2, 0]], atol=1e-6)
    assert scene.normals[:2].any() == 0 and scene.normals[2].any()
    assert scene.uv[1].tolist() == [[0, 0], [1, 1], [0, 1]]
    assert scene.colours[-2:].tolist() == [[np.float32(0.7)] * 3, [0, 1, 0]]
    assert scene.lights[0].intensity == (1, 0.5, 0) and scene.environment.ground == (1, 0, 0)
    assert len(scene.emitters) == 12 and scene.camera.eye == (0, 1, 5)


BAD = {
    "no JSON": (lambda s: "{", "no JSON"),
    "unknown key": (lambda s: s.update(mesh=[]), "scene: unknown key 'mesh'; did you mean meshes"),
    "unknown key inside": (lambda s: s["materials"]["white"].update(difuse=[1, 1, 1]),
                           r"scene.materials.white: unknown key 'difuse'; did you mean diffuse"),
    "missing key": (lambda s: s["meshes"][1]["sphere"].pop("radius"),
                    r"scene.meshes\[1\].sphere: no 'radius'"),
    "negative radius": (lambda s: s["meshes"][1]["sphere"].update(radius=-1),
                        r"meshes\[1\].sphere.radius is -1; give more than 0"),
    "negative scale": (lambda s: s["meshes"][2].update(scale=-2), r"meshes\[2\].scale is -2"),
    "inverted box": (lambda s: s["meshes"][2]["box"].update(hi=[1, -1, 1]),
                     r"meshes\[2\].box.hi is \[1, -1, 1\]"),
    "share": (lambda s: s["materials"]["white"].update(diffuse=[2, 0, 0]),
              r"materials.white.diffuse is \[2.0, 0.0, 0.0\]"),
    "type": (lambda s: s["meshes"][1].update(smooth="yes"), "meshes.1..smooth is 'yes'"),
    "shapes": (lambda s: s["meshes"][1].update(file="two.obj"), "file and sphere; give one of"),
    "material": (lambda s: s["meshes"][0].update(material="wod"),
                 "no material 'wod'; did you mean wood"),
    "group": (lambda s: s["meshes"][3].update(materials={"lefft": "white"}),
              "two.obj has no 'lefft'; did you mean left"),
    "texture": (lambda s: s["materials"]["wood"].update(texture="no.png"),
                "materials.wood.texture: .*no.png: no such texture"),
    "texture file": (lambda s: s["materials"]["wood"].update(texture="two.obj"),
                     "materials.wood.texture: .*cannot read this texture"),
    "mesh file": (lambda s: s["meshes"][3].update(file="no.obj"), r"meshes\[3\].file: .*no such"),
    "dark light": (lambda s: s["lights"][0].update(intensity=[0, 0, 0]),
                   r"lights\[0\].intensity is 0, so the light has no effect"),
    "dark sky": (lambda s: s.update(environment={"colour": [0, 0, 0]}), "environment is black"),
    "two skies": (lambda s: s["environment"].update(colour=[1, 1, 1]), "give either colour"),
    "camera": (lambda s: s["camera"].update(target=[0, 1, 5]), "camera: .*both"),
    "a huge whole number": (lambda s: s["camera"].update(eye=[10 ** 400, 0, 0]),
                            r"camera.eye is \[1000.*\.\.\.; give three finite numbers"),
    "a huge radius": (lambda s: s["meshes"][1]["sphere"].update(radius=10 ** 400),
                      r"sphere.radius is 1000.*\.\.\.; give a finite number"),
    "past float32": (lambda s: s["materials"]["lamp"].update(emission=[1e300, 0, 0]),
                     r"lamp.emission is \[1e\+300, 0.0, 0.0\]; give numbers up to 1e\+30"),
    "far eye": (lambda s: s["camera"].update(eye=[0, 1e39, 0]), "camera.eye is .* up to 1e.30"),
    "large fov": (lambda s: s["camera"].update(fov_degrees=-1e39), "fov_degrees is -1e.39; give"),
    "long texture": (lambda s: s["materials"]["wood"].update(texture="n" * 5000),
                     "materials.wood.texture: .*no such texture"),
    "long image": (lambda s: s.update(environment={"image": "n" * 5000 + ".png"}),
                   "environment.image: .*no such texture"),
    "long file": (lambda s: s["meshes"][3].update(file="n" * 5000 + ".obj"),
                  r"meshes\[3\].file: .*no such file"),
    "long scene": (lambda s: s["meshes"][3].update(file="n" * 5000),
                   r"meshes\[3\].file: no scene 'nnn"),
    "no meshes": (lambda s: s.update(meshes=[]), "meshes is empty"),
    "no light": (lambda s: [s.pop("lights"), s.pop("environment"), s["meshes"].pop(2)],
                 "the scene has no light"),
}


@pytest.mark.parametrize("name", BAD)
def test_invalid_contents_are_refused_in_one_line(name: str, folder: Path) -> None:
    change, message = BAD[name]
    said = copy.deepcopy(GOOD)
    changed = change(said)
    path = written(folder, changed if isinstance(changed, str) else said)
    with pytest.raises(rt.SceneError, match=message) as caught:
        rt.load_scene(path)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_the_documented_schema_equals_the_keys() -> None:
    """The JSON schema in docs/ equals the schema of the scene keys.

    To write the file: ``python -c 'import json; from gpgpu_rt.scene.scene_keys import schema;
    print(json.dumps(schema(), indent=1))' > docs/scene.schema.json``.
    """
    assert json.loads((DOCS / "scene.schema.json").read_text()) == schema()


def test_every_key_is_documented() -> None:
    words = (DOCS / "scene-files.md").read_text()
    for keys in OBJECTS.values():
        for name, key in keys.items():
            assert f"`{name}`" in words and key.help in words, name


def test_the_example_in_the_documentation_is_a_scene(folder: Path) -> None:
    words = (DOCS / "scene-files.md").read_text()
    example = words.split("```json")[1].split("```")[0]
    scene = rt.load_scene(written(folder, example))
    assert {"glass", "mirror"} <= {m.name for m in scene.used_materials}


def test_missing_textures_of_mesh_files_are_errors(folder: Path) -> None:
    for words, message in (("gone.png", "two.mtl: no such texture gone.png"),
                           ("-s 1 1 1 my wood.png",
                            "wood.png .options before the name are not read"),
                           ("noise.png", "two.mtl: noise.png is no image")):
        (folder / "noise.png").write_bytes(b"noise")
        Image.new("RGB", (2, 2)).save(folder / "my wood.png")
        (folder / "two.mtl").write_text(f"newmtl green\nKd 0 1 0\nmap_Kd {words}\n")
        with pytest.raises(rt.SceneError, match=message):
            rt.load_scene(folder / "two.obj")
    (folder / "two.mtl").write_text("newmtl green\nKd 1 1 1\nmap_Kd my wood.png\n")
    # This error shows that the texture was read.
    with pytest.raises(rt.SceneError, match="green has a texture, but the mesh has no"):
        rt.load_scene(folder / "two.obj")


def test_mtl_materials_are_read(folder: Path) -> None:
    (folder / "two.mtl").write_text(
        "newmtl green\nKd 0 1 0\nKs 0.5 0.5 0.5\nNs 198\nillum 2\nKe 1 0 0\n")
    (material,) = rt.load_scene(folder / "two.obj").materials
    assert material.diffuse == (0, 1, 0) and material.emission == (1, 0, 0)
    assert material.glossy == (0.5, 0, 0.5) and abs(material.roughness - 0.1) < 1e-6
    (folder / "two.mtl").write_text("newmtl green\nKd 0 0 0\nKs 0.8 0.8 0.8\nillum 3\n")
    assert rt.load_scene(folder / "two.obj").materials[0].mirror[0] == 0.8
    (folder / "two.mtl").write_text("newmtl green\nKd 0.5 0.5 0.5\nNi 1.45\nillum 7\n")
    assert rt.load_scene(folder / "two.obj").materials[0].ior == 1.45


def test_corners_of_obj_files_have_their_own_values(folder: Path) -> None:
    (folder / "n.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\nvn 0 0 1\nvn 0 1 0\n"
        "f 1/1/1 2/2/1 3/3/1\nf 1/4/2 2/2/2 3/3/2\n")
    scene = rt.load_scene(folder / "n.obj")
    assert scene.uv[:, 0].tolist() == [[0, 0], [0.5, 0.5]]
    assert scene.normals[:, 0].tolist() == [[0, 0, 1], [0, 1, 0]]
    assert scene.faces.tolist() == [[0, 1, 2], [0, 1, 2]]  # the file's own vertex numbers


def test_gltf_metals_are_mirrors_or_glossy(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    for rough, part in ((0.0, "mirror"), (0.5, "glossy")):
        box.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name="gold", baseColorFactor=[255, 204, 51, 255], metallicFactor=1.0,
                roughnessFactor=rough, emissiveFactor=[0, 1, 0]))
        box.export(tmp_path / "gold.glb")
        (material,) = rt.load_scene(tmp_path / "gold.glb").used_materials
        assert np.allclose(getattr(material, part), (1, 0.8, 0.2)) and not any(material.diffuse)
        assert material.emission == (0, 1, 0)


def test_a_false_backdrop_means_no_environment(folder: Path) -> None:
    said = {**GOOD, "environment": {"backdrop": False}}
    assert rt.load_scene(written(folder, said)).environment is None


def test_a_texture_without_coordinates_is_refused(folder: Path) -> None:
    said = copy.deepcopy(GOOD)
    said["meshes"][1]["material"] = "wood"
    with pytest.raises(rt.SceneError, match=r"meshes\[1\] has no texture coordinates"):
        rt.load_scene(written(folder, said))


def test_deep_json_and_byte_order_marks(folder: Path) -> None:
    """JSON that is nested too deeply is refused. A byte order mark at the start is skipped."""
    with pytest.raises(rt.SceneError, match="no JSON"):
        rt.load_scene(written(folder, "[" * 100_000))
    path = written(folder, GOOD)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert rt.load_scene(path).name == "still"


def gltf(folder: Path, material: dict[str, Any], **images: tuple[int, int, int]) -> Path:
    """Writes a glTF file of a textured triangle with the given material, and returns the file's
    path.

    images : name of an image -> its colour; texture k uses the k-th image
    """
    box = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], process=False)
    box.visual = trimesh.visual.TextureVisuals(uv=[(0, 0), (1, 0), (0, 1)])
    box.export(folder / "m.gltf")
    path = folder / "m.gltf"
    said = json.loads(path.read_text())
    said["materials"] = [material]
    said["images"] = [{"uri": f"{name}.png"} for name in images]
    said["textures"] = [{"source": k} for k in range(len(images))]
    for name, colour in images.items():
        Image.new("RGB", (2, 2), colour).save(folder / f"{name}.png")
    path.write_text(json.dumps(said))
    return path


def test_textures_without_a_factor_are_taken_as_they_are(folder: Path) -> None:
    """If a glTF or MTL file gives a texture but no factor for it, the factor is 1."""
    texture = {"baseColorTexture": {"index": 0}}
    for said, share in ((texture, 1), ({**texture, "baseColorFactor": [0.2, 0.2, 0.2, 1]}, 0.2),
                        ({}, 1)):
        scene = rt.load_scene(gltf(folder, {"pbrMetallicRoughness": said}, t=(9, 9, 9)))
        assert np.allclose(scene.materials[0].diffuse, share) and np.allclose(scene.colours, share)
    (folder / "n.obj").write_text("mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\n"
                                  "vt 0 1\nusemtl a\nf 1/1 2/2 3/3\n")
    for words, share in (("", 1), ("Kd 0.123456 0.4 0.4\n", (0.123456, 0.4, 0.4))):
        (folder / "two.mtl").write_text(f"newmtl a\n{words}map_Kd wood.png\n")
        assert np.allclose(rt.load_scene(folder / "n.obj").materials[0].diffuse, share, atol=1e-7)


def test_a_lamp_is_its_factor_times_the_mean_of_its_texture(folder: Path) -> None:
    """A material's emission is its factor times the mean of its emission texture."""
    said = {"emissiveFactor": [1, 0.5, 1], "emissiveTexture": {"index": 0}}
    for colour, radiance in (((0, 0, 0), (0, 0, 0)), ((255, 255, 0), (1, 0.5, 0))):
        scene = rt.load_scene(gltf(folder, said, glow=colour))
        assert scene.materials[0].emission == radiance
        (folder / "two.mtl").write_text("newmtl green\nKe 1 0.5 1\nmap_Ke glow.png\n")
        assert rt.load_scene(folder / "two.obj").materials[0].emission == radiance
    assert len(scene.emitters) == 1
    (folder / "two.mtl").write_text("newmtl green\nKe 1 0.5 1\nmap_Ke gone.png\n")
    with pytest.raises(rt.SceneError, match="two.mtl: no such texture gone.png"):
        rt.load_scene(folder / "two.obj")


def test_a_textured_metal_is_tinted_by_its_mean(folder: Path) -> None:
    said = {"baseColorTexture": {"index": 0}, "metallicFactor": 1.0, "roughnessFactor": 0.0}
    (material,) = rt.load_scene(
        gltf(folder, {"pbrMetallicRoughness": said}, gold=(255, 0, 255))).materials
    assert material.mirror == (1, 0, 1) and material.texture is None
    (material,) = rt.load_scene(gltf(folder, {
        "pbrMetallicRoughness": {**said, "metallicFactor": 0.5}}, gold=(255, 0, 255))).materials
    assert material.mirror == (0.5, 0, 0.5) and material.diffuse == (0.5,) * 3
    assert material.texture is not None


def test_names_in_gltf_files_are_uris(folder: Path) -> None:
    path = gltf(folder, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, a=(9, 0, 0))
    path.write_text(path.read_text().replace("a.png", "my%20tex.png"))
    # The texture's file has the decoded name or, from some writers, the encoded name.
    for name in ("my tex.png", "my%20tex.png"):
        (folder / "a.png").rename(folder / name)
        texture = rt.load_scene(path).materials[0].texture
        assert texture is not None and texture.texels[0, 0, 0] > 0
        (folder / name).rename(folder / "a.png")
    with pytest.raises(rt.SceneError, match="no such texture my%20tex.png"):
        rt.load_scene(path)


def test_equal_texture_coordinates_are_kept(folder: Path) -> None:
    """Texture coordinates are kept even if all corners of a triangle have the same coordinates."""
    (folder / "n.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    said = {**GOOD, "meshes": [{"file": "n.obj", "material": "wood"}]}
    scene = rt.load_scene(written(folder, said))
    assert scene.uv is not None and not scene.uv.any()
    scene = rt.load_scene(written(folder, {**said, "meshes": GOOD["meshes"][2:3]}))
    assert scene.uv is None and scene.normals is None


def test_arrays_that_are_no_textures_are_refused(folder: Path) -> None:
    np.savez(folder / "z.npz", np.ones((2, 2, 3)))
    np.save(folder / "c.npy", np.ones((2, 2, 3), complex))
    whole = (folder / "c.npy").read_bytes()
    for data, message in ((b"", "not a single array"), (whole, "complex128"),
                          ((folder / "z.npz").read_bytes(), "not a single array"),
                          (whole[:40], "cannot read this texture")):
        (folder / "t.npy").write_bytes(data)
        said = {**GOOD, "materials": {**GOOD["materials"], "wood": {"texture": "t.npy"}}}
        with pytest.raises(rt.SceneError, match=f"materials.wood.texture: .*{message}"):
            rt.load_scene(written(folder, said))


def textured_scene(*sizes: tuple[int, int]) -> rt.Scene:
    """Returns a scene with one triangle for each texture size (height, width)."""
    textures = [Texture(f"t{k}", np.full((*size, 3), k + 1.0)) for k, size in enumerate(sizes)]
    count = len(sizes)
    return rt.Scene.from_arrays(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)] * count, uv=np.zeros((count, 3, 2)),
        materials=[rt.Material(t.name, texture=t) for t in textures], material_of=range(count))


def test_textures_lie_side_by_side_and_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """The atlas holds each texture at its place, and textures that do not fit are refused."""
    monkeypatch.setattr(images, "WIDTH", 8)
    monkeypatch.setattr(images, "HEIGHT", 15)
    scene = textured_scene((3, 4), (9, 2), (9, 2), (5, 4), (7, 4), (1, 9))
    texels, at = images.atlas(scene), images.places(scene)
    assert texels.shape[:2] == (15, 9)  # stacked vertically, the textures need 34 rows
    for k, material in enumerate(scene.materials):
        x, y, width, height = (at[name][k] for name in ("x", "y", "width", "height"))
        assert np.array_equal(texels[y:y + height, x:x + width, :3], material.texture.texels)
    with pytest.raises(rt.LimitError, match="add up to 19 rows of 5 .* make them smaller"):
        images.atlas(textured_scene((10, 5), (9, 5)))
