"""File kinds: valid examples of the files that the program reads, and functions that read them."""
from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import shutil
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.accel import cache
from gpgpu_rt.cli.frames import write_film
from gpgpu_rt.cli.tracing import _read_rays
from gpgpu_rt.cli.unfinished import Unfinished
from gpgpu_rt.methods import settings
from gpgpu_rt.methods.bih.tree import build_bih
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.grid.cells import build_grid
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.rays import ray_sets as rays

from .mutations import Rng, mutated, mutated_arrays, mutated_json

RENDERED = 20       # one of 20 loaded scenes is also drawn


def write_case(kind: str, seed: int, folder: Path) -> None:
    rng = np.random.default_rng([seed, sorted(KINDS).index(kind)])
    KINDS[kind][0](folder, rng)


def read_case(kind: str, seed: int, folder: Path) -> None:
    """Read the files of a case; raise rt.Error if they cannot be read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        KINDS[kind][1](folder, seed)


@functools.cache
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=1)


OBJ = ("mtllib m.mtl\n" + "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1)
                                  for z in (0, 1))
       + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl a\ng one\nf 1/1 2/2 3/3\nf 3/1 4/2 2/3\n"
       "usemtl b\ng two\nf 5//1 6//1 7//1 8//1\nusemtl a\nf -1 -2 -3\nf 1/1/1 2/2/1 5/3/1\n"
       ).encode()
MTL = (b"newmtl a\nKd 0.5 0.2 0.1\nmap_Kd a.png\nNs 20\nillum 2\nKs 0.2 0.2 0.2\nnewmtl b\n"
       b"Kd 0 1 0\nKe 1 1 1\nmap_Ke a.png\nnewmtl c\nNi 1.5\nillum 7\n")
AFF = b"""v from 0 1 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 64 64
b 0.1 0.1 0.2
am 1 1 1
l 0 5 5 0.5 0.5 0.5
a 0 1 3
i 0 paint.aff
x arm { xs 1 2 1 0 0 1 30 0 1 0 {
m vertices 4 0 0 0 1 0 0 1 1 0 0 1 0 normals 1 0 0 1
texturecoords 3 a.png 0 0 1 0 1 1
triangles 2 0 1 2 0 0 0 0 1 2 2 3 0 0 0 0 0 1 2 }
p 4 0 0 1 1 0 1 1 1 1 0 1 1 # a square
tt a.png 0 0 2 0 0 1 0 2 1 0 0 1 2 0 1
pp 3 0 0 3 0 0 1 1 0 3 0 0 1 0 1 3 0 0 1 }
tpa 2 0 0 0 4 0 0 1 1 0 4 0 0 1 0 1 4 0 0 1 1 0 0 5 0 0 1 1 0 5 0 0 1 0 1 5 0 0 1
s 0 0 0 0.5
c 0 0 0 1 0 0 1 0.5
i 0 paint.aff
k arm { transl 4 -1 0 0 0 0 0 0 0 0 0 0 0.5 0 0 1 1 0 0 0 0.5 0 2 1 0 0 0 0 0
rot 4 -1 0 1 0 0 0 0 0 0 0 1 0 45 0 0 0 1 0 1 0 90 0 0 0 2 0 1 0 90 0 0 0 visibility 1 0.5 1 }
"""
PAINT = b"fm 0.1 0.1 0.1 0.5 0.2 0.1 0.3 0.3 0.3 20 0 0\n% f\xe4rg\n"
SCENE: dict[str, Any] = {
    "name": "s", "meshes": [
        {"file": "m.obj", "material": "red", "scale": 2, "rotate": [0, 30, 0],
         "translate": [0, 1, 0], "smooth": True},
        {"box": {"lo": [0, 0, 0], "hi": [1, 1, 1]}, "material": "glass"},
        {"sphere": {"centre": [2, 0, 0], "radius": 0.5, "triangles": 80}},
        {"quad": [[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]], "material": "floor"}],
    "materials": {"red": {"diffuse": [0.8, 0.1, 0.1], "glossy": [0.1, 0.1, 0.1],
                          "roughness": 0.3},
                  "glass": {"ior": 1.5}, "floor": {"texture": "a.png"},
                  "lamp": {"emission": [1, 1, 1]}},
    "lights": [{"position": [0, 5, 0], "intensity": [1, 1, 1]}],
    "environment": {"zenith": [0.1, 0.1, 0.2], "ground": [0.1, 0.1, 0.1]},
    "camera": {"eye": [0, 2, 6], "target": [0, 0, 0], "fov_degrees": 40}}
CAMERA = {"eye": [0, 1, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_degrees": 45.0}


@functools.cache
def picture(kind: str) -> bytes:
    made = io.BytesIO()
    Image.fromarray(np.arange(8 * 8 * 3, dtype=np.uint8).reshape(8, 8, 3)).save(made, kind)
    return made.getvalue()


@functools.cache
def meshes() -> dict[str, bytes]:
    found = {"m.obj": OBJ, "m.aff": AFF}
    for name, kind, more in (("a.ply", "ply", {"encoding": "ascii"}), ("b.ply", "ply", {}),
                             ("a.stl", "stl_ascii", {}), ("b.stl", "stl", {}),
                             ("m.glb", "glb", {}), ("m.off", "off", {})):
        content = ball().export(file_type=kind, **more)
        found[name] = content.encode() if isinstance(content, str) else content
    parts = trimesh.Scene([ball(), trimesh.creation.box()]).export(file_type="gltf")
    tree = json.loads(parts["model.gltf"])
    for buffer in tree["buffers"]:
        import base64
        data = base64.b64encode(parts[buffer["uri"]]).decode()
        buffer["uri"] = "data:application/octet-stream;base64," + data
    return {**found, "m.gltf": json.dumps(tree).encode()}


def look_at(scene: rt.Scene, seed: int) -> None:
    if seed % RENDERED == 0:
        with rt.Tracer(scene, "bvh-threaded") as tracer:
            tracer.render(size=(8, 8))


# Kinds ------------------------------------------------------------------------------------------

def _mesh(folder: Path, rng: Rng) -> None:
    name = sorted(meshes())[int(rng.integers(len(meshes())))]
    change = mutated_json if name.endswith(".gltf") else mutated
    _put(folder, {"m.mtl": MTL, "a.png": picture("PNG"), "paint.aff": PAINT,
                  name: change(meshes()[name], rng)})


def _load_mesh(folder: Path, seed: int) -> None:
    path = next(path for path in folder.iterdir() if path.name in meshes())
    look_at(rt.load_scene(path), seed)


def _material(folder: Path, rng: Rng) -> None:
    files = {"m.obj": OBJ, "m.mtl": MTL, "a.png": picture(str(rng.choice(
        ["PNG", "JPEG", "BMP", "GIF", "TIFF", "WEBP"])))}
    name = ("m.mtl", "a.png")[int(rng.integers(2))]
    _put(folder, {**files, name: mutated(files[name], rng)})


def _scene(folder: Path, rng: Rng) -> None:
    numbers = io.BytesIO()
    np.save(numbers, np.ones((4, 8, 3), np.float32))
    said = {**SCENE}
    if rng.random() < 0.2:
        said["environment"] = {"image": "sky.npy"}
    sky = numbers.getvalue()
    _put(folder, {"m.obj": OBJ, "m.mtl": MTL, "a.png": picture("PNG"),
                  "sky.npy": mutated(sky, rng) if rng.random() < 0.3 else sky,
                  "s.json": mutated_json(json.dumps(said).encode(), rng)})


def _load_scene(folder: Path, seed: int) -> None:
    look_at(rt.load_scene(folder / "s.json"), seed)


def _archive(arrays: dict[str, np.ndarray], rng: Rng) -> bytes:
    """Return an .npz file, mutated as bytes or as arrays."""
    as_bytes = rng.random() < 0.5
    made = io.BytesIO()
    save: Callable[..., None] = np.savez if rng.random() < 0.5 else np.savez_compressed
    save(made, **(arrays if as_bytes else mutated_arrays(arrays, rng)))
    return mutated(made.getvalue(), rng) if as_bytes else made.getvalue()


def _rays(folder: Path, rng: Rng) -> None:
    origins, directions = rays.random_rays(rt.load_scene("cornell"), 40, 1)
    _put(folder, {"r.npz": _archive({"origins": origins, "directions": directions,
                                     "t_min": np.zeros(40), "t_max": np.full(40, 9.0)}, rng)})


@functools.cache
def cornell() -> rt.Tracer:
    return rt.Tracer("cornell", "bvh-threaded")


def _trace(folder: Path, seed: int) -> None:
    given = _read_rays(str(folder / "r.npz"))
    try:
        cornell().trace(**given, invalid=("raise", "miss")[seed % 2])
    except ValueError as failure:       # its message names an invalid ray
        raise rt.Error(str(failure)) from failure


@functools.cache
def tuned() -> bytes:
    scene = rt.load_scene("cornell")
    entry = {"method": "bvh-packet", "options": {"packet": [4, 2], "octants": True},
             "promise": {"max_wrong": 1e-5, "max_t_error": 1e-5}, "measured": {"rate": 1.5}}
    return json.dumps({"format": settings.FORMAT, "scene": settings.describe(scene),
                       "renderer": "x", "coherent": entry, "incoherent": {
                           **entry, "method": "kd-restart", "options": {}}}).encode()


def _settings(folder: Path, rng: Rng) -> None:
    _put(folder, {"s.json": mutated_json(tuned(), rng)})


def _load_settings(folder: Path, seed: int) -> None:
    settings.load(folder / "s.json")
    with rt.Tracer.from_settings("cornell", folder / "s.json", force=True):
        pass


def _animation(folder: Path, rng: Rng) -> None:
    if rng.random() < 0.5:
        files = {"a.png": picture("PNG"), "paint.aff": PAINT, "a.aff": AFF}
        name = ("paint.aff", "a.aff")[int(rng.integers(2))]
        return _put(folder, {**files, name: mutated(files[name], rng)})
    frames = np.stack([ball().vertices * (1 + k / 10) for k in range(3)])
    _put(folder, {"a.npz": _archive({"vertices": frames, "faces": ball().faces}, rng)})


def _animate(folder: Path, seed: int) -> None:
    animation = rt.load_animation(next(path for path in folder.iterdir() if path.stem == "a"
                                       and path.suffix != ".png"))
    for frame in range(min(animation.frames or 1, 20)):
        animation.scene.moved(animation.vertices(frame))
        animation.drawing(frame, {})


def _cameras(folder: Path, rng: Rng) -> None:
    _put(folder, {"m.ply": meshes()["b.ply"], "cameras.json": mutated_json(
        json.dumps({"m": CAMERA, "other": CAMERA}).encode(), rng)})


def _load_cameras(folder: Path, seed: int) -> None:
    rt.load_scene(folder / "m.ply").camera.rays((4, 4))


STRUCTURES = {build_bvh: "bvh-threaded", build_kdtree: "kd-restart",
              build_bih: "bih", build_grid: "grid"}


@functools.cache
def built(build: Any) -> dict[str, np.ndarray]:
    triangles = np.ascontiguousarray(ball().triangles, np.float32)
    return {name: np.asarray(value) for name, value in vars(build(triangles)).items()}


def _cache(folder: Path, rng: Rng) -> None:
    build = list(STRUCTURES)[int(rng.integers(len(STRUCTURES)))]
    arrays = mutated_arrays(built(build), rng) if rng.random() < 0.7 else built(build)
    arrays = {**arrays, "checksum": cache._checksum(arrays)}
    made = io.BytesIO()
    np.savez(made, **arrays)
    content = mutated(made.getvalue(), rng) if rng.random() < 0.3 else made.getvalue()
    _put(folder, {f"{build.__name__}.npz": content})


def _use_cache(folder: Path, seed: int) -> None:
    path = next(folder.glob("*.npz"))
    method = next(name for build, name in STRUCTURES.items() if build.__name__ == path.stem)
    kept = folder / "cache"
    kept.mkdir()
    with _environment("GPGPU_RT_CACHE", str(kept)):
        for name in cache_names(method):
            shutil.copy(path, kept / name)
        with rt.Tracer(ball_scene(), method) as tracer:
            hits = tracer.trace(*rays.random_rays(ball_scene(), 16, 1))
    if not np.array_equal(hits.status, np.zeros(16)):
        raise AssertionError(f"statuses are {hits.status.tolist()}")


@functools.cache
def ball_scene() -> rt.Scene:
    corners = ball().triangles.reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))


@functools.cache
def cache_names(method: str) -> tuple[str, ...]:
    with cache.cache_files() as files, rt.Tracer(ball_scene(), method):
        return tuple(path.name for path in files)


@contextlib.contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _resume(folder: Path, rng: Rng) -> None:
    whole = Unfinished(folder / "o.gif", 3, {"seed": 1}, False)
    for part in range(2):
        whole.keep(part, Image.new("RGB", (8, 8), (part * 80, 9, 9)))
    whole._lock.release()
    name = ("parts.json", "parts.json", "00000.png", "00001.png")[int(rng.integers(4))]
    path = folder / "o.gif.unfinished" / name
    change = mutated_json if name.endswith("json") else mutated
    path.write_bytes(change(path.read_bytes(), rng))


def _go_on(folder: Path, seed: int) -> None:
    kept = Unfinished(folder / "o.gif", 3, {"seed": 1}, True)
    with contextlib.redirect_stderr(io.StringIO()), kept.until_whole():
        for part in kept.missing:
            kept.keep(part, Image.new("RGB", (8, 8)))
        write_film(str(folder / "o.gif"), kept)


def _put(folder: Path, files: dict[str, bytes]) -> None:
    for name, content in files.items():
        (folder / name).write_bytes(content)


Write, Read = Callable[[Path, Rng], None], Callable[[Path, int], None]
KINDS: dict[str, tuple[Write, Read]] = {
    "mesh": (_mesh, _load_mesh), "material": (_material, _load_mesh),
    "scene": (_scene, _load_scene), "rays": (_rays, _trace),
    "settings": (_settings, _load_settings), "animation": (_animation, _animate),
    "cameras": (_cameras, _load_cameras), "cache": (_cache, _use_cache),
    "resume": (_resume, _go_on)}
