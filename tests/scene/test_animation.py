"""The vertices of a frame depend only on the frame's number, and the command line writes every
frame."""
from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.scene import catalogue
from gpgpu_rt.scene.procedural import walker
from gpgpu_rt.scene.procedural.animations import MOTIONS

SMALL = ["--size", "16x16"]


@pytest.mark.parametrize("name", MOTIONS)
def test_frames_follow_from_their_numbers(name: str) -> None:
    animation = rt.load_animation(name)
    late = animation.vertices(30)
    start = animation.scene.moved(animation.vertices(0))
    np.testing.assert_array_equal(start.triangles, animation.scene.triangles)
    assert (animation.vertices(30) == late).all() and np.isfinite(late).all()
    after = animation.scene.moved(late)
    assert len(after) == catalogue.ROWS[name].triangles and after.camera == start.camera
    assert np.abs(after.triangles - start.triangles).max() > 0.1 * start.extent
    hits = rt.reference.trace(after, *after.camera.rays((12, 12)), accelerated=True)
    assert hits.hit.mean() > 0.1


def test_the_walker_walks() -> None:
    """Parts of the walker turn and move but keep their shape. Its lowest point stays near the
    ground. At any time, a hoof moves more slowly than the body, and another hoof moves faster. The
    ground does not move."""
    count, places = walker.walker().triangles.shape[0], []
    for frame in range(0, 54, 2):
        places.append(walker.walker_at(frame / 24.0))
    moved, animal = np.array(places), slice(0, len(walker._rest()[0]))
    assert moved.shape == (27, count, 3, 3)
    assert (moved[:, animal.stop:] == moved[0, animal.stop:]).all()
    edges = np.linalg.norm(moved[:, animal, 1:] - moved[:, animal, :1], axis=-1)
    assert np.abs(edges - edges[0]).max() < 1e-5
    lowest = moved[:, animal, :, 1].min(axis=(1, 2))
    assert (-0.12 < lowest).all() and (lowest < 0.12).all()
    hooves = [np.flatnonzero(walker._rest()[1] == walker.LEGS + 2 * leg + 1)[-1]
              for leg in range(4)]
    steps = np.linalg.norm(np.diff(moved[:, hooves, 0], axis=0), axis=-1)  # (26, 4)
    whole = np.linalg.norm(np.diff(moved[:, 0, 0], axis=0), axis=-1)
    assert (steps.min(axis=1) < 0.7 * whole).all() and (steps.max(axis=1) > 1.2 * whole).all()


def small_animation(path, frames: int = 3) -> None:
    vertices = np.random.default_rng(1).random((frames, 30, 3))
    np.savez(path, vertices=vertices, faces=np.arange(30).reshape(-1, 3))


def test_numbered_files(tmp_path, capsys) -> None:
    """Frames are written to numbered files, and equal the pictures of an updated tracer."""
    small_animation(tmp_path / "soup.npz")
    assert main(["render", str(tmp_path / "soup.npz"), "--frames", "3", *SMALL, "-o",
                 str(tmp_path / "out_%03d.png")]) == 0
    assert "refitted 2 times" in capsys.readouterr().out
    images = [np.asarray(Image.open(tmp_path / f"out_{k:03d}.png")) for k in range(3)]
    animation = rt.load_animation(tmp_path / "soup.npz")
    with rt.Tracer(animation.scene) as tracer:
        for frame, image in enumerate(images):
            if frame:
                tracer.update(animation.vertices(frame))
            assert (np.asarray(tracer.render(size=(16, 16))) == image).all()
    assert (images[0] != images[1]).any()
    (tmp_path / "there").mkdir()
    for folder in ("there", "new/"):
        assert main(["render", str(tmp_path / "soup.npz"), "--frames", "2", *SMALL, "-o",
                     str(tmp_path / folder) + ("/" if folder[-1] == "/" else "")]) == 0
        assert sorted(p.name for p in (tmp_path / folder).iterdir()) == [
            "frame_0000.png", "frame_0001.png"]


@pytest.mark.parametrize("suffix", ["gif", "png"])
def test_films(suffix: str, tmp_path) -> None:
    """Frames are written to one film file, and no other file is left."""
    small_animation(tmp_path / "soup.npz")
    film = tmp_path / f"film.{suffix}"
    assert main(["render", str(tmp_path / "soup.npz"), "--frames", "3", *SMALL, "-o",
                 str(film)]) == 0
    with Image.open(film) as image:
        assert image.n_frames == 3 and image.size == (16, 16) and image.info["loop"] == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"film.{suffix}", "soup.npz"]


@pytest.mark.parametrize("words, message", [
    (["bunny", "--frames", "2", "-o", "a.gif"], "does not move"),
    (["clth", "--frames", "2", "-o", "a.gif"], "did you mean cloth"),
    (["soup.npz", "--frames", "4", "-o", "a.gif"], "has only 3 frames"),
    (["soup.npz", "--frames", "2", "-o", "a.jpg"], "film"),
    (["soup.npz", "--frames", "2", "-o", "no/a_%d.png"], "no folder"),
    (["soup.npz", "--frames", "2", "-o", "a_%d.xyz"], "numbered frames"),
    (["gone.npz", "--frames", "2", "-o", "a.gif"], "gone.npz"),
    (["empty.npz", "--frames", "2", "-o", "a.gif"], "faces")])
def test_mistakes_are_one_line_and_leave_nothing(words: list, message: str, tmp_path, monkeypatch,
                                                 capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    small_animation(tmp_path / "soup.npz")
    np.savez(tmp_path / "empty.npz", vertices=np.zeros((2, 3, 3)))
    assert main(["render", *words, *SMALL]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and message in error
    assert sorted(p.name for p in tmp_path.iterdir()) == ["empty.npz", "soup.npz"]


def test_a_broken_frame_leaves_no_film(tmp_path, capsys) -> None:
    vertices = np.random.default_rng(1).random((3, 30, 3))
    vertices[2, 5] = np.nan
    np.savez(tmp_path / "soup.npz", vertices=vertices, faces=np.arange(30).reshape(-1, 3))
    assert main(["render", str(tmp_path / "soup.npz"), "--frames", "3", *SMALL, "-o",
                 str(tmp_path / "film.gif")]) == 1
    assert "vertex 5" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["soup.npz"]


@pytest.mark.parametrize("words", [["0"], ["-1"], ["two"]])
def test_frames_are_a_number(words: list, capsys) -> None:
    with pytest.raises(SystemExit):
        main(["render", "cloth", "--frames", *words, "-o", "a.gif"])
    assert "not a number of frames" in capsys.readouterr().err
