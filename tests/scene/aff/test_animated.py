"""An AFF file that declares frames is an animation with as many frames, and its camera may
move."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.workers.digest import digest

VIEW = "v from 0 0 9 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 64 64\nb 0 0 0.5\nl 0 0 9\n"
MOVE = "transl 4  0 0 0 0 0 0 0  0 0 0 0 0 0 0  10 2 0 0 0 0 0  10 2 0 0 0 0 0\n"
# A square that does not move, and a roof of two sides that moves. The roof has four vertices. Each
# side has its own normal, even at the two vertices of the ridge, which both sides share.
PARTS = """p 4 -9 -9 -1  9 -9 -1  9 9 -1  -9 9 -1
x roof { fm 1 1 1 0.9 0 0 0 0 0 0 0 0
m vertices 4 -1 0 0  0 -1 1  0 1 1  1 0 0  normals 2 -1 0 1  1 0 1
triangles 2  0 1 2 0 0 0  3 2 1 1 1 1 }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "a.aff").write_text(f"{VIEW}a 0 10 5\n{PARTS}k roof {{ {MOVE} }}\n")
    return tmp_path / "a.aff"


def test_frames(path: Path) -> None:
    animation = rt.load_animation(path)
    assert animation.frames == 5 and animation.camera is None and animation.scene.moving
    start = animation.scene.triangles
    np.testing.assert_array_equal(start, rt.load_scene(path).triangles)
    for frame, x in ((0, 0), (2, 1), (4, 2), (9, 2)):
        vertices = animation.vertices(frame)
        assert vertices.dtype == np.float32
        now = animation.scene.moved(vertices)
        assert (now.triangles[:2] == start[:2]).all()
        np.testing.assert_allclose(now.triangles[2:] - start[2:], [[(x, 0, 0)] * 3] * 2,
                                   atol=1e-7)
    assert digest(animation.vertices) == digest(rt.load_animation(path).vertices)


def test_edges_stay_sharp(path: Path) -> None:
    """The two sides of the roof share vertices, but not their normals."""
    normals = rt.load_animation(path).scene.normals
    np.testing.assert_allclose(normals[2:], np.repeat(
        [[(-1, 0, 1)], [(1, 0, 1)]], 3, axis=1) / np.sqrt(2), atol=1e-6)
    np.testing.assert_allclose(normals[:2], np.broadcast_to((0, 0, 1), (2, 3, 3)), atol=1e-6)


def test_corners_that_meet_at_first_may_part(tmp_path: Path) -> None:
    """Corners with equal positions at frame 0 do not share a vertex if they may separate later.
    There are three cases: a triangle that grows from a point, a hidden part, and parts that
    touch."""
    def patch(size: int) -> str:
        return f"0 0 0 0 0 1  {size} 0 0 0 0 1  0 {size} 0 0 0 1 "
    (tmp_path / "a.aff").write_text(
        f"a 0 10 2 tpa 2 0 {patch(0)} 10 {patch(4)}"
        f"x one {{ pp 3 {patch(1)} }} x two {{ pp 3 {patch(1)} }}"
        f"k one {{ visibility 2 -1 0 5 1 }} k two {{ {MOVE} }}")
    animation = rt.load_animation(tmp_path / "a.aff")
    area = [np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2
            for t in (animation.scene.moved(animation.vertices(k)).triangles for k in (0, 1))]
    np.testing.assert_allclose(area, [(0, 0, 0.5), (8, 0.5, 0.5)], atol=1e-6)


def test_a_file_without_frames_does_not_move(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text(PARTS)
    with pytest.raises(rt.SceneError, match="does not move; add a line") as caught:
        rt.load_animation(tmp_path / "a.aff")
    assert str(caught.value).startswith(str(tmp_path / "a.aff"))
    (tmp_path / "a.aff").write_text("a 0 1 5\nq")
    with pytest.raises(rt.SceneError, match="a.aff, line 2: no statement"):
        rt.load_animation(tmp_path / "a.aff")
    with pytest.raises(rt.SceneError, match="no such file"):
        rt.load_animation(tmp_path / "gone.aff")


def test_a_vertex_that_overflows_float32_is_refused(path: Path, capsys) -> None:
    path.write_text(path.read_text().replace("10 2 0 0", "10 1e300 0 0"))
    words = ["--frames", "5", "--size", "8x8", "-o", str(path.parent / "f.gif")]
    assert main(["render", str(path), *words]) == 1
    assert "not finite in float32" in capsys.readouterr().err
    assert not (path.parent / "f.gif").exists()


def frames_of(path: Path, *words: str) -> list[np.ndarray]:
    """Returns the pictures of three frames that the command line draws."""
    out = path.parent / "f%d.png"
    assert main(["render", str(path), "--frames", "3", "--size", "32x32", *words, "-o",
                 str(out)]) == 0
    return [np.asarray(Image.open(path.parent / f"f{k}.png")) for k in range(3)]


def test_frames_follow_the_camera(path: Path) -> None:
    still = frames_of(path)
    keys = " ".join(f"{time} {x} 0 9 0 0 0 " for time, x in ((0, 0), (0, 0), (10, 2), (10, 2)))
    path.write_text(f"{path.read_text()} k camera {{ transl 4 {keys} }}")
    animation = rt.load_animation(path)
    assert animation.camera(0) == animation.scene.camera
    np.testing.assert_allclose(animation.camera(4).eye, (2, 0, 9))
    np.testing.assert_allclose(animation.camera(4).target, (2, 0, 0))
    followed = frames_of(path)
    with rt.Tracer(animation.scene) as tracer:
        for frame in range(3):
            tracer.update(animation.vertices(frame))
            expected = tracer.render(**animation.drawing(frame, {"size": (32, 32)}))
            assert (followed[frame] == np.asarray(expected)).all()
    assert (followed[0] == still[0]).all() and (followed[2] != still[2]).any()
    # An option of the camera, such as --fov, fixes the camera at its place of frame 0.
    for held, same in zip(frames_of(path, "--fov", "40"), still):
        assert (held == same).all()
