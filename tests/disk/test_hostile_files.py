"""Tests of hostile files: FIFOs, small files that declare large contents, and texts and names that
are not UTF-8."""
from __future__ import annotations

import io
import json
import os
import struct
import subprocess
import sys
import threading
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.cli import main
from gpgpu_rt.disk import budget
from gpgpu_rt.disk.arrays import read_npz
from gpgpu_rt.disk.files import open_input

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def within_seconds(seconds: float, run: Callable[[], object]) -> object:
    """Returns the result or the exception of ``run``. Fails if ``run`` has not ended after
    ``seconds``."""
    found: list[object] = []

    def catch() -> None:
        try:
            found.append(run())
        except BaseException as failure:
            found.append(failure)
    thread = threading.Thread(target=catch, daemon=True)
    thread.start()
    thread.join(seconds)
    assert found, "the call hangs"
    return found[0]


def png(width: int, height: int) -> bytes:
    """Returns a PNG file of black texels. The file is much smaller than its decoded image."""
    def chunk(kind: bytes, data: bytes) -> bytes:
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))
    packer = zlib.compressobj(9)
    row = bytes(1 + (width + 7) // 8)
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 1, 0, 0,
                                                              0, 0))
            + chunk(b"IDAT", data) + chunk(b"IEND", b""))


# Encodings --------------------------------------------------------------------------------------

def test_an_obj_in_latin_1_loads(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_bytes("# Fläche\nnewmtl Grün\nKd 0 1 0\n".encode("latin-1"))
    (tmp_path / "m.obj").write_bytes(
        f"# Würfel\nmtllib m.mtl\nusemtl Grün\n{TRIANGLE}".encode("latin-1"))
    scene = rt.load_scene(tmp_path / "m.obj")
    assert scene.materials[0].name == "Grün" and scene.colours.tolist() == [[0, 1, 0]]


@pytest.mark.parametrize("kind", ["stl_ascii", "stl", "ply", "off"])
def test_other_meshes_in_latin_1_load(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"m.{kind.split('_')[0]}"
    mesh = trimesh.creation.icosphere(subdivisions=1)
    content = mesh.export(file_type=kind, **({"encoding": "ascii"} if kind == "ply" else {}))
    if kind == "stl":
        content = b"K\xf6rper".ljust(80, b"\0") + content[80:]
    elif kind == "stl_ascii":
        content = content.replace("solid", "solid Körper", 1).encode("latin-1")
    elif kind == "ply":
        content = content.replace(b"format", b"comment K\xf6rper\nformat", 1)
        head, _, rest = content.partition(b"comment K\xf6rper\n")
        line, _, rest = rest.partition(b"\n")
        content = head + line + b"\ncomment K\xf6rper\n" + rest
    else:
        content = content.replace("OFF", "OFF\n# Körper", 1).encode("latin-1")
    path.write_bytes(content)
    assert len(rt.load_scene(path)) == 80


@pytest.mark.parametrize("library, note", [
    (None, "no such file of materials"), ("folder", "it is a folder"), ("fifo", "it is a FIFO")])
def test_a_material_file_that_cannot_be_read_is_noted(library: str | None, note: str,
                                                      tmp_path: Path) -> None:
    path = tmp_path / "gone.mtl"
    if library == "folder":
        path.mkdir()
    elif library == "fifo":
        os.mkfifo(path)
    (tmp_path / "m.obj").write_text(f"mtllib gone.mtl\nusemtl a\n{TRIANGLE}")
    with pytest.warns(UserWarning, match=f"gone.mtl.*{note}|{note}.*gone.mtl") as said:
        found = within_seconds(20, lambda: rt.load_scene(tmp_path / "m.obj"))
    assert isinstance(found, rt.Scene) and len(said) == 1


# trimesh's logger -------------------------------------------------------------------------------

def test_a_broken_normal_is_no_traceback(tmp_path: Path) -> None:
    """A mesh file with a broken normal loads, and trimesh prints no traceback. The test needs a
    separate process, because pytest captures log messages."""
    content = trimesh.creation.box().export(file_type="stl_ascii").replace(
        "facet normal ", "facet normal x", 1)
    (tmp_path / "m.stl").write_text(content)
    answer = subprocess.run([sys.executable, "-c", "import sys, gpgpu_rt as rt\n"
                             "print(len(rt.load_scene(sys.argv[1])))", tmp_path / "m.stl"],
                            capture_output=True, text=True)
    assert (answer.stdout, answer.stderr) == ("12\n", "")


def test_a_missing_texture_of_a_ply_file_is_refused(tmp_path: Path, capfd) -> None:
    content = trimesh.creation.box().export(file_type="ply", encoding="ascii").replace(
        b"element vertex", b"comment TextureFile gone.png\nelement vertex", 1)
    (tmp_path / "m.ply").write_bytes(content)
    with pytest.raises(rt.SceneError, match="no such texture gone.png"):
        rt.load_scene(tmp_path / "m.ply")
    assert capfd.readouterr() == ("", "")


# Sizes ------------------------------------------------------------------------------------------

def test_blanks_of_an_obj_are_read_once(tmp_path: Path) -> None:
    """The time to read many blanks in a row does not grow with the square of their number."""
    (tmp_path / "m.obj").write_text(f"{TRIANGLE}{' ' * 200_000}\nf 1{' ' * 200_000}2 3\n")
    assert isinstance(within_seconds(20, lambda: rt.load_scene(tmp_path / "m.obj")), rt.Scene)


def test_runs_of_materials_are_read_once(tmp_path: Path) -> None:
    """Each face is read once, however many material changes the file has. If every change copied
    all vertices, 16,000 changes would need minutes and 12 GB."""
    runs = "".join(f"usemtl m{k % 7}\ng g{k}\nf 1 2 3\n" for k in range(16_000))
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "v 5 5 5\n" * 30_000 + runs)
    scene = within_seconds(60, lambda: rt.load_scene(tmp_path / "m.obj"))
    assert isinstance(scene, rt.Scene) and len(scene) == 16_000
    assert (scene.triangles == scene.triangles[0]).all()


def gltf(**changed: object) -> bytes:
    """Returns a glTF file of one triangle, with the parts in ``changed`` replaced."""
    data = np.eye(3, dtype="<f4").tobytes()
    import base64
    tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": "data:;base64,"
                         + base64.b64encode(data).decode()}]}
    return json.dumps({**tree, **changed}).encode()


DECLARED = {
    "accessor without data": ("m.gltf", lambda: gltf(accessors=[
        {"componentType": 5126, "count": 10 ** 8, "type": "VEC3"}])),
    "accessor past its data": ("m.gltf", lambda: gltf(accessors=[
        {"bufferView": 0, "componentType": 5126, "count": 10 ** 8, "type": "VEC3"}])),
    "view past its buffer": ("m.gltf", lambda: gltf(bufferViews=[
        {"buffer": 0, "byteLength": 10 ** 10}])),
    "ply of many vertices": ("m.ply", lambda: (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 100000000\nproperty float x\n"
        b"property float y\nproperty float z\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n" + bytes(400))),
    "ply of an element without properties": ("m.ply", lambda: (
        b"ply\nformat ascii 1.0\nelement nothing 100000000000\nelement vertex 3\n"
        b"property float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")),
}


@pytest.mark.parametrize("what", DECLARED)
def test_what_a_header_declares_is_checked_first(what: str, tmp_path: Path, monkeypatch) -> None:
    name, content = DECLARED[what]
    (tmp_path / name).write_bytes(content())

    def load(*given, **more):
        raise AssertionError("trimesh was called and would allocate the declared size")
    monkeypatch.setattr(trimesh, "load_scene", load)
    with pytest.raises(rt.SceneError, match="declares|counts|ends after"):
        rt.load_scene(tmp_path / name)


def test_a_small_gltf_loads(tmp_path: Path) -> None:
    (tmp_path / "m.gltf").write_bytes(gltf())
    assert len(rt.load_scene(tmp_path / "m.gltf")) == 1


def test_instances_are_counted(tmp_path: Path, monkeypatch) -> None:
    scene = trimesh.Scene()
    for k in range(40):
        scene.add_geometry(trimesh.creation.icosphere(subdivisions=2), geom_name="one",
                           transform=trimesh.transformations.translation_matrix([k, 0, 0]))
    (tmp_path / "m.glb").write_bytes(scene.export(file_type="glb"))
    assert len(rt.load_scene(tmp_path / "m.glb")) == 40 * 320
    monkeypatch.setenv(budget.VARIABLE, "0.5")
    with pytest.raises(rt.LimitError, match="m.glb|instances"):
        rt.load_scene(tmp_path / "m.glb")


@pytest.mark.filterwarnings("error")
def test_a_large_image_is_refused_by_its_header(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(13_000, 13_000))
    assert os.path.getsize(tmp_path / "a.png") < 50_000
    with pytest.raises(rt.LimitError, match="a.png.* 13000 x 13000 .*GPGPU_RT_BUDGET"):
        rt.Texture.load(tmp_path / "a.png")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd a.png\n")
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\nusemtl a\n{TRIANGLE}")
    with pytest.raises(rt.LimitError, match="a.png"):
        rt.load_scene(tmp_path / "m.obj")


def test_texels_follow_the_srgb_formula() -> None:
    """The lookup table from bytes to linear values equals the sRGB formula in float64, rounded to
    float32 and then to float16."""
    image = Image.fromarray(np.random.default_rng(3).integers(0, 256, (9, 7, 3)).astype(np.uint8))
    bytes_ = np.asarray(image).astype(np.float64) / 255
    expected = np.where(bytes_ <= 0.04045, bytes_ / 12.92, ((bytes_ + 0.055) / 1.055) ** 2.4)
    expected = expected.astype(np.float32).astype(np.float16).astype(np.float32)
    assert np.array_equal(rt.Texture.from_image(image).texels, expected)
    assert np.array_equal(rt.Texture("same", expected).texels, expected)


def test_an_archive_that_inflates_is_refused(tmp_path: Path, monkeypatch) -> None:
    np.savez_compressed(tmp_path / "r.npz", origins=np.zeros((10 ** 6, 3)))
    assert os.path.getsize(tmp_path / "r.npz") < 30_000
    assert read_npz(tmp_path / "r.npz", "rays")["origins"].shape == (10 ** 6, 3)
    monkeypatch.setenv(budget.VARIABLE, "20")
    with pytest.raises(rt.LimitError, match="r.npz.* 23 MiB .*GPGPU_RT_BUDGET"):
        read_npz(tmp_path / "r.npz", "rays")
    assert read_npz(tmp_path / "r.npz", "rays", names=("directions",)) == {}
    np.savez(tmp_path / "r.npz", origins=np.zeros((10 ** 6, 3)))
    assert len(read_npz(tmp_path / "r.npz", "rays")) == 1  # the array is no larger than the file


@pytest.mark.parametrize("shape", [(10 ** 9, 3), (10 ** 18, 10 ** 18), (-1, 3)])
def test_an_array_that_declares_more_than_it_holds_is_refused(shape: tuple[int, int],
                                                              tmp_path: Path) -> None:
    member = io.BytesIO()
    np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False,
                                                  "shape": shape})
    with zipfile.ZipFile(tmp_path / "r.npz", "w") as file:
        file.writestr("origins.npy", member.getvalue() + bytes(64))
    with pytest.raises(rt.Error, match="not an .npz archive of plain arrays"):
        read_npz(tmp_path / "r.npz", "rays")


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_plain_arrays_are_read(save: Callable, tmp_path: Path) -> None:
    whole = np.arange(6).reshape(2, 3)
    arrays = {"a": whole + 0.5, "f": np.asfortranarray(whole),
              "empty": np.zeros((0, 3), np.float32),
              "scalar": np.array(7), "b": np.array([True])}
    save(tmp_path / "r.npz", **arrays)
    found = read_npz(tmp_path / "r.npz", "arrays")
    assert list(found) == list(arrays)
    for name, value in arrays.items():
        assert np.array_equal(found[name], value) and found[name].dtype == value.dtype
        found[name][...] = 0  # the caller may write to the arrays


@pytest.mark.parametrize("text", ["x", "-1", "0", "nan", "1e30"])
def test_a_budget_that_is_no_number_is_named(text: str, monkeypatch) -> None:
    monkeypatch.setenv(budget.VARIABLE, text)
    with pytest.raises(rt.OptionError, match="GPGPU_RT_BUDGET"):
        budget.budget_bytes()


@pytest.mark.parametrize("shape", [
    {"quad": [[0, 0, 0], [10 ** 25, 0, 0], [1, 1, 0], [0, 1, 0]]},
    {"box": {"lo": [0, 0, 0], "hi": [1, 10 ** 25, 1]}},
    *({"box": {"lo": [0, 0, 0], "hi": [1, 1, 1]}, key: [10 ** 25, 0, 0]}
      for key in ("rotate", "translate", "scale"))])
def test_whole_numbers_past_int64_are_numbers(shape: dict, tmp_path: Path) -> None:
    shape = {**shape, "scale": [10 ** 25, 1, 1]} if "scale" in shape else shape
    (tmp_path / "s.json").write_text(json.dumps({
        "meshes": [shape], "lights": [{"position": [0, 9, 0]}]}))
    assert len(rt.load_scene(tmp_path / "s.json")) in (2, 12)


# FIFOs and devices ------------------------------------------------------------------------------

@pytest.mark.parametrize("command", [
    ["render", "{}/m.ply"], ["render", "{}/m.obj"], ["render", "{}/m.json"],
    ["render", "{}/m.npz"], ["render", "/dev/zero"], ["trace", "cornell", "{}/m.npz"],
    ["trace", "cornell", "/dev/zero"], ["render", "cornell", "--settings", "{}/m.json"],
    ["render", "{}/m.npz", "--frames", "2"], ["render", "{}/texture.json"]], ids=" ".join)
def test_a_fifo_is_refused(command: list[str], tmp_path: Path, capsys) -> None:
    for name in ("m.ply", "m.obj", "m.json", "m.npz", "m.png"):
        os.mkfifo(tmp_path / name)
    trimesh.creation.box().export(tmp_path / "beside.ply")
    (tmp_path / "texture.json").write_text(json.dumps({
        "meshes": [{"file": "beside.ply"}], "environment": {"image": "m.png"}}))
    output = "h.npz" if command[0] == "trace" else "x.gif" if "--frames" in command else "x.png"
    words = [word.replace("{}", str(tmp_path)) for word in command]
    status = within_seconds(60, lambda: main([*words, "-o", str(tmp_path / output)]))
    error = capsys.readouterr().err
    assert status == 1 and error.count("\n") == 1 and ("FIFO" in error or "device" in error)


def test_cameras_in_a_fifo_are_ignored(tmp_path: Path) -> None:
    trimesh.creation.box().export(tmp_path / "m.ply")
    os.mkfifo(tmp_path / "cameras.json")
    found = within_seconds(60, lambda: rt.load_scene(tmp_path / "m.ply"))
    assert isinstance(found, rt.Scene)


def test_names_that_no_file_can_have_raise_an_error() -> None:
    """A name that no file can have raises an OSError, as a missing file does."""
    for name in ("a\0b", "x" * 5000):
        with pytest.raises(OSError):
            open_input(name)


# Names ------------------------------------------------------------------------------------------

def test_a_name_that_is_not_utf_8_is_read_and_written(tmp_path: Path, monkeypatch) -> None:
    name = os.fsdecode(b"caf\xe9")
    trimesh.creation.box().export(tmp_path / "m.ply")
    os.rename(tmp_path / "m.ply", tmp_path / f"{name}.ply")
    for encoding in ("utf-8", "ascii"):
        out = io.TextIOWrapper(io.BytesIO(), encoding)
        monkeypatch.setattr("sys.stdout", out)
        for words in ([], ["--json"]):
            assert main(["render", str(tmp_path / f"{name}.ply"), "--size", "8", "-o",
                         str(tmp_path / f"{name}.png"), *words]) == 0
        assert main(["methods"]) == 0  # prints a name that is not ASCII: Günther
    assert (tmp_path / f"{name}.png").is_file()
    assert rt.load_scene(tmp_path / f"{name}.ply").name == "caf?"


@pytest.mark.parametrize("output, message", [
    ("{}/f%999999d.png", "at most 9 digits"), ("/dev/", "choose another folder"),
    ("/dev/f_%04d.png", "choose another folder"), ("/dev/x.gif", "choose another folder")])
def test_bad_frame_names_are_refused(output: str, message: str, tmp_path: Path, capsys) -> None:
    assert main(["render", "cloth", "--frames", "1", "--size", "8", "-o",
                 output.replace("{}", str(tmp_path))]) == 1
    error = capsys.readouterr().err
    assert message in error and len(error) < 300 and not list(tmp_path.iterdir())


def test_a_device_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "out.png")
    with pytest.raises(rt.Error, match="it is a FIFO"):
        rt.GeometryImage([np.random.default_rng(1).random((3, 3, 3))]).save(tmp_path / "out.png")


@pytest.mark.parametrize("command", [
    ["render", "cornell", "-o", "{}/x.png"], ["passes", "cornell", "-m", "grid", "-o", "{}/p"],
    ["render", "cloth", "--frames", "1", "-o", "{}/x.gif"]], ids=lambda words: words[0])
def test_a_full_disk_names_the_file(command: list[str], tmp_path: Path, capsys) -> None:
    resource = pytest.importorskip("resource")
    rt.Tracer("cornell", "grid").release()  # write the cache before the size of files is limited
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, before[1]))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            status = main([*(w.replace("{}", str(tmp_path)) for w in command), "--size", "32"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    lines = [line for line in capsys.readouterr().err.splitlines() if "cannot" in line]
    assert status == 1 and len(lines) == 1 and str(tmp_path) in lines[0]
    assert "File too large" in lines[0]
