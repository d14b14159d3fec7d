"""The meshes of BART's robots and kitchen equal, bit for bit, known PLY files that another program
made from BART's files. Parts keep their shape while they move."""
from __future__ import annotations

import hashlib
import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.scene import catalogue, mesh_file
from gpgpu_rt.scene.loading import list_scenes
from gpgpu_rt.scene.mesh import Mesh

VARIABLE = "GPGPU_RT_ORIGINALS"     # the folder with BART-Animations
# The numbers of triangles and vertices, and the SHA-256 of the PLY file that another program made
# from the original.
KNOWN = {
    "robots-moving": (71_708, 134_127,
                      "b4deeb876b58d145984567eb5ab56cd01b68265f2220102cfa68117dc5b47b86"),
    "kitchen-moving": (110_561, 63_706,
                       "ce4adc029d94b56ee5c04712189b2e87e1729b80a10bb9627fc6bcb9bdfcef13")}
pytestmark = [
    pytest.mark.skipif(VARIABLE not in os.environ, reason=f"{VARIABLE} is not set"),
    pytest.mark.filterwarnings("ignore:.*no texture")]


@pytest.fixture(params=KNOWN)
def name(request, tmp_path: Path, monkeypatch) -> str:
    (tmp_path / "originals").symlink_to(Path(os.environ[VARIABLE]).absolute())
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path))
    return request.param


def as_ply(mesh: Mesh) -> bytes:
    """Returns the content of the binary PLY file of a mesh."""
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    return (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\n"
            "end_header\n").encode() + mesh.vertices.astype("<f4").tobytes() + faces.tobytes()


def test_the_bits_of_the_mesh(name: str) -> None:
    triangles, vertices, digest = KNOWN[name]
    mesh = mesh_file.read(catalogue.mesh_path(name))
    assert (len(mesh.faces), len(mesh.vertices)) == (triangles, vertices)
    assert hashlib.sha256(as_ply(mesh)).hexdigest() == digest


def test_the_scene_and_its_animation(name: str) -> None:
    scene, animation = rt.load_scene(name), rt.load_animation(name)
    row = next(row for row in list_scenes() if row["name"] == name)
    assert row["triangles"] == len(scene) == catalogue.ROWS[name].triangles
    assert row["found"] == scene.source
    assert (scene.triangles == animation.scene.triangles).all()
    assert (animation.scene.moved(animation.vertices(0)).triangles == scene.triangles).all()
    assert animation.frames == 800 and animation.scene.moving
    assert animation.camera(0) == scene.camera and animation.camera(200) != scene.camera
    # The animation computes normals from the vertices. These normals nearly equal the file's
    # normals.
    cosine = (animation.scene.normals * scene.normals).sum(axis=2)
    assert np.percentile(cosine, 5) > 0.99
    sent = pickle.loads(pickle.dumps(animation))
    assert (sent.vertices(400) == animation.vertices(400)).all()
    assert sent.camera(400) == animation.camera(400)


def triangles_at(animation: rt.Animation, frame: int) -> np.ndarray:
    return animation.scene.moved(animation.vertices(frame)).triangles.astype(np.float64)


def test_parts_move_as_a_whole(name: str) -> None:
    """Some of the triangles move, and every triangle keeps its shape."""
    animation = rt.load_animation(name)
    start, moved = triangles_at(animation, 0), np.zeros(len(animation.scene), bool)
    for frame in (100, 400, 780):
        now = triangles_at(animation, frame)
        edges, before = (np.linalg.norm(t - np.roll(t, 1, axis=1), axis=2) for t in (now, start))
        largest = np.maximum(np.abs(now), np.abs(start)).max(axis=(1, 2))[:, None]
        assert (np.abs(edges - before) < 1e-6 * (before + largest)).all()
        moved |= (now != start).any(axis=(1, 2))
    assert 0.03 < moved.mean() < 0.95


JOINTS = [("ro_arm", "ru_arm"), ("lo_arm", "lu_arm"), ("ru_arm", "rg1"), ("lo_leg", "lu_leg"),
          ("lu_leg", "l_heel"), ("l_heel", "l_middle"), ("l_middle", "l_toes"),
          ("ru_leg", "r_heel"), ("r_middle", "r_toes")]
ROBOTS = 10


def test_no_robot_loses_a_limb(name: str) -> None:
    """The gap between the limbs on both sides of a joint stays below 0.35 units. A robot is 10
    units high."""
    if name != "robots-moving":
        pytest.skip("the kitchen has no robots")
    animation, mesh = rt.load_animation(name), mesh_file.read(catalogue.mesh_path(name))
    rows = {part: np.flatnonzero(mesh.part_of == mesh.parts.index(part)).reshape(ROBOTS, -1)
            for pair in JOINTS for part in pair}
    for frame in (0, 100, 250, 400, 780):
        now = triangles_at(animation, frame)
        for pair in JOINTS:
            for robot in (0, 7):
                one, other = (now[rows[part][robot]].reshape(-1, 3) for part in pair)
                gap = np.linalg.norm(one[:, None] - other[None], axis=2).min()
                assert gap < 0.35, (frame, pair, robot)
