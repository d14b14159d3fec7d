"""``gpgpu-rt scenes --fetch`` puts complete scenes where `load_scene` finds them. A mistake on the
command line leaves no files."""
from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.cli import scenes as module
from gpgpu_rt.cli.main import main
from gpgpu_rt.scene import catalogue
from gpgpu_rt.scene.originals.conversion import ORIGINALS, Original
from gpgpu_rt.scene.originals.sources import SourceFile, source_files

BOX = trimesh.creation.box()


def _file(scene: str, path: str, content: bytes) -> SourceFile:
    return SourceFile(scene, "owner/meshes", "0" * 40, path, len(content),
                      hashlib.sha256(content).hexdigest(), "free for all")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """Return a user's folder. Its subfolder ``copy`` has small originals of two scenes: the bunny
    in an archive, and the robots in three files. Two of the three files are equal."""
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.chdir(tmp_path)
    archive, box = io.BytesIO(), BOX.export(file_type="ply")
    with zipfile.ZipFile(archive, "w") as writer:
        writer.writestr("bunny/box.ply", box)
    contents = {"bunny": {"bunny.zip": archive.getvalue()},
                "robots": {"aff/top.ply": box, "aff/arm.ply": box[:100], "aff/leg.ply": box[:100]}}
    files = {}
    for scene, named in contents.items():
        files[scene] = tuple(_file(scene, path, content) for path, content in named.items())
        for file, content in zip(files[scene], named.values()):
            place = tmp_path / "copy" / file.place
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
    monkeypatch.setattr(module, "source_files", lambda: files)
    monkeypatch.setitem(ORIGINALS, "bunny", Original("bunny/box.ply", 12))
    monkeypatch.setitem(ORIGINALS, "robots", Original("top.ply", 12, keeps_files=True))
    return tmp_path


def fetch(*words: str) -> int:
    return main(["scenes", "--fetch", *words, "--from", "copy", "--yes"])


def files_of(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_scenes_are_found_by_their_names(folder: Path, capsys) -> None:
    assert fetch("bunny", "robots") == 0
    out, err = capsys.readouterr()
    data = folder / "data/gpgpu_rt/scenes"
    assert files_of(data) == ["bunny.ply", "cameras.json", "originals/meshes/aff/arm.ply",
                              "originals/meshes/aff/leg.ply", "originals/meshes/aff/top.ply",
                              "robots.ply"]
    for text in ("bunny: 1 file", "owner/meshes at 000000", "terms: free for all", str(data)):
        assert text in err
    assert f"bunny: 12 triangles, {data / 'bunny.ply'}" in out
    for name in ("bunny", "robots"):
        scene = rt.load_scene(name)
        camera = json.loads((data / "cameras.json").read_text())[name]
        assert scene.stand_in is None and list(scene.camera.eye) == camera["eye"]
        np.testing.assert_array_equal(scene.triangles, BOX.triangles.astype(np.float32))
    assert fetch("bunny,robots-moving") == 0        # nothing is left to do
    err = capsys.readouterr().err
    assert "bunny is there" in err and "robots is there" in err


def test_the_users_folder_comes_first_and_keeps_its_files(folder: Path, monkeypatch) -> None:
    own = folder / "own"
    own.mkdir()
    BOX.subdivide().export(own / "robots.ply")
    (own / "cameras.json").write_text('{"robots": {"eye": [0, 0, 9], "target": [0, 0, 0]}}')
    before = (own / "robots.ply").read_bytes()
    monkeypatch.setenv("GPGPU_RT_SCENES", os.pathsep.join([str(own), str(folder / "copy")]))
    assert fetch("bunny", "robots") == 0
    assert (own / "robots.ply").read_bytes() == before
    cameras = json.loads((own / "cameras.json").read_text())
    assert cameras["robots"]["eye"] == [0, 0, 9] and "bunny" in cameras
    assert (own / "bunny.ply").exists() and not (folder / "data").exists()
    assert (own / "originals/meshes/aff/arm.ply").exists()


@pytest.mark.parametrize("words, message", [
    (["fairyforest"], "cannot be fetched: https://www.sci.utah.edu/~wald/animrep/"),
    (["tenk"], "tenk is built in, so there is nothing to fetch"),
    (["fairy-forst"], "did you mean fairyforest"),
    (["buny"], "did you mean bunny"),
    (["bunny", "--from", "nowhere"], "--from nowhere: there is no such folder; check the path"),
    (["bunny", "--from", "localhost:8000"], "did you mean http://localhost:8000?"),
    (["bunny", "--from", "copy/meshes"], "the folder has none of meshes"),
    (["bunny", "--from", "http://127.0.0.1:9"], "cannot reach")])
def test_mistakes_are_one_line_and_leave_nothing(folder: Path, words: list, message: str,
                                                 capsys) -> None:
    assert main(["scenes", "--fetch", *words, "--yes"]) == 1
    lines = [line for line in capsys.readouterr().err.splitlines()
             if line.startswith("gpgpu-rt: ")]
    assert len(lines) == 1 and message in lines[0]
    assert not (folder / "data").exists()


def test_a_damaged_file_leaves_the_finished_scenes(folder: Path, capsys) -> None:
    (folder / "copy/meshes/aff/arm.ply").write_bytes(b"no arm")
    assert fetch("bunny", "robots") == 1
    assert "is not the expected file" in capsys.readouterr().err
    data = folder / "data/gpgpu_rt/scenes"
    assert "bunny.ply" in files_of(data) and "robots.ply" not in files_of(data)
    (folder / "copy/meshes/aff/arm.ply").write_bytes(BOX.export(file_type="ply")[:100])
    assert fetch("bunny", "robots") == 0 and "robots.ply" in files_of(data)


@pytest.mark.parametrize("step", ["download", "convert", "_add_camera", "_convert"])
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("before", [False, True], ids=["after", "before"])
def test_an_interrupted_fetch_ends_the_same(folder: Path, monkeypatch, capsys, step: str,
                                            number: int, before: bool) -> None:
    """The user interrupts before or after a call of a step. If the command runs again, it
    completes the fetch."""
    done, calls = getattr(module, step), 0

    def interrupted(*given):
        nonlocal calls
        calls += 1
        if before and calls == number:
            raise KeyboardInterrupt
        result = done(*given)
        if calls == number:
            raise KeyboardInterrupt
        return result

    with monkeypatch.context() as patch:
        patch.setattr(module, step, interrupted)
        assert fetch("bunny", "robots") == 130
    assert "interrupted" in capsys.readouterr().err
    assert fetch("bunny", "robots") == 0
    data = folder / "data/gpgpu_rt/scenes"
    assert files_of(data) == ["bunny.ply", "cameras.json", "originals/meshes/aff/arm.ply",
                              "originals/meshes/aff/leg.ply", "originals/meshes/aff/top.ply",
                              "robots.ply"]
    assert set(json.loads((data / "cameras.json").read_text())) == {"bunny", "robots"}
    assert not (data / ".fetching").exists()


def test_what_a_killed_run_left_is_removed(folder: Path) -> None:
    data = folder / "data/gpgpu_rt/scenes"
    (data / ".fetching/unpacked/bunny").mkdir(parents=True)
    (data / ".fetching/unpacked/bunny/old.ply").write_text("half")
    assert fetch("bunny") == 0
    assert files_of(data) == ["bunny.ply", "cameras.json"] and not (data / ".fetching").exists()


def test_consent(folder: Path, capsys, monkeypatch) -> None:
    words = ["scenes", "--fetch", "bunny", "--from", "copy"]
    assert main(words) == 1
    assert "without a terminal, give --yes" in capsys.readouterr().err
    for answer, status in (("n\n", 1), ("", 1), ("yes\n", 0)):
        terminal = io.StringIO(answer)
        terminal.isatty = lambda: True      # type: ignore[method-assign]
        monkeypatch.setattr("sys.stdin", terminal)
        assert main(words) == status
        assert (folder / "data").exists() == (status == 0)


def test_options_belong_to_fetch(capsys) -> None:
    assert main(["scenes", "--yes"]) == 1 and "add --fetch" in capsys.readouterr().err


def test_every_scene_has_a_source_or_a_page() -> None:
    """A scene with a stand-in can be fetched, or its catalogue row has a ``page``: a hint where
    the user finds the mesh. Scenes that are built around other scenes are exempt."""
    assert set(source_files()) == set(ORIGINALS) <= set(catalogue.ROWS)
    derived = {"statue", "glass-teapot", "soft-shadows"}     # built around other scenes
    for row in catalogue.ROWS.values():
        assert row.name in {*ORIGINALS, *derived} or (row.page is not None) == bool(row.stand_in)
        assert row.file is None or row.name.removesuffix("-moving") in ORIGINALS


ORIGINALS_FOLDER = os.environ.get("GPGPU_RT_ORIGINALS")
# The first 16 digits of the SHA-256 of each scene's triangles, (n, 3, 3) float32.
DIGESTS = {"bunny": "6b43d979b823ec6d", "conference": "b0aa5e61551c000e",
           "cornell": "9c55162aee16d84b", "kitchen": "c9a80d31113513e2",
           "robots": "77e556aee7a6f557", "teapot": "68274553c11df5f9"}


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.full if name == "conference" else ())
    for name in ORIGINALS])
@pytest.mark.skipif(not ORIGINALS_FOLDER, reason="GPGPU_RT_ORIGINALS names no copy of the "
                    "originals")
def test_the_published_files(name: str, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_SCENES", "")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert main(["scenes", "--fetch", name, "--from", ORIGINALS_FOLDER, "--yes"]) == 0
    scene = rt.load_scene(name)
    assert len(scene) == ORIGINALS[name].triangles and scene.stand_in is None
    digest = hashlib.sha256(np.ascontiguousarray(scene.triangles, "<f4").tobytes()).hexdigest()
    assert digest[:16] == DIGESTS[name]
