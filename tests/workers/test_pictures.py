"""Workers draw the same tiles and frames as a single process, even after a worker was killed or
the run was interrupted."""
from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.cli import distributed as sharing
from gpgpu_rt.cli import folder_lock as claim
from gpgpu_rt.cli.folder_lock import FolderLock
from gpgpu_rt.scene.procedural.animations import MOTIONS
from gpgpu_rt.workers import Workers
from gpgpu_rt.workers.digest import digest

pytest.importorskip("distributed")

SIZE = (40, 24)
WORDS = ["--size", "40x24", "-m", "bvh-packet"]
# If the tests run as a background job of a shell, they and their children ignore Ctrl-C. This
# script restores the usual handling of Ctrl-C.
COMMAND = """
import signal, sys
from gpgpu_rt import cli
signal.signal(signal.SIGINT, signal.default_int_handler)
if __name__ == "__main__":
    sys.exit(cli.main(sys.argv[1:]))
"""


def kill_one(workers: Workers) -> int:
    """Kills a worker and returns the number of its process."""
    pid = next(iter(workers.client.run(os.getpid).values()))
    os.kill(pid, signal.SIGKILL)
    return pid


@pytest.mark.parametrize("integrator, picture", [
    ("direct", {}), ("whitted", {"samples": 2}), ("path", {"samples": 5})])
def test_tiles_make_up_the_picture_of_one_process(integrator: str, picture: dict,
                                                  workers: Workers, precise_renderer) -> None:
    told: list[tuple[int, int]] = []
    found = workers.render("cornell-light", "bvh-packet", SIZE, None, integrator, picture, 16,
                           lambda *at: told.append(at), packet=(2, 1))
    with rt.Tracer("cornell-light", "bvh-packet", packet=(2, 1)) as tracer:
        alone = tracer.render(size=SIZE, integrator=integrator, **picture)
    assert (np.asarray(found) == np.asarray(alone)).all() and np.asarray(found).std() > 5
    assert told[-1] == (6, 6)


def moving(path: Path, frames: int = 6) -> rt.Animation:
    """Writes and returns an animation. Its triangles move far, so methods rebuild their trees."""
    vertices = np.random.default_rng(1).random((frames, 300, 3))
    np.savez(path, vertices=vertices, faces=np.arange(300).reshape(-1, 3))
    return rt.load_animation(path)


@pytest.mark.parametrize("method", ["bvh-threaded", "kd-restart"])
def test_frames_of_a_killed_worker_are_drawn_again(method: str, workers: Workers, tmp_path,
                                                   precise_renderer) -> None:
    """Frames equal the frames of a single process, even if a worker is killed."""
    animation = moving(tmp_path / "soup.npz")
    drawing = {"size": (16, 16), "integrator": "path", "samples": 2}
    killed: list[int] = []

    def kill_at_first(done: int, of: int) -> None:
        if done == 1:
            killed.append(kill_one(workers))

    found = dict(workers.frames(animation, range(6), method, kill_at_first, drawing))
    assert killed and sorted(found) == list(range(6))
    with rt.Tracer(animation.scene, method) as tracer:
        for frame in range(6):
            tracer.update(animation.vertices(frame))
            assert (found[frame] == np.asarray(tracer.render(**drawing))).all(), frame
    assert any((found[frame] != found[0]).any() for frame in found)


def test_frames_follow_a_moving_camera(workers: Workers, tmp_path, precise_renderer) -> None:
    animation = moving(tmp_path / "soup.npz", 3)
    animation = replace(animation, camera=lambda frame: rt.Camera((frame, 0, 3), (0, 0, 0)))
    held = {"size": (16, 16), "camera": rt.Camera((0, 0, 3), (0, 0, 0))}
    followed = dict(workers.frames(animation, range(3), drawing={"size": (16, 16)}))
    still = dict(workers.frames(animation, range(3), drawing=held))
    with rt.Tracer(animation.scene) as tracer:
        for frame in range(3):
            tracer.update(animation.vertices(frame))
            for found, camera in ((followed, animation.camera(frame)), (still, held["camera"])):
                alone = tracer.render(camera, (16, 16))
                assert (found[frame] == np.asarray(alone)).all()
    assert (followed[2] != still[2]).any()


def test_a_tracer_with_moved_triangles_is_not_used_for_the_scene(workers: Workers,
                                                                 tmp_path) -> None:
    animation = moving(tmp_path / "soup.npz", 3)
    list(workers.frames(animation, range(3), "kd-restart", drawing={"size": (8, 8)}))
    origins, directions = animation.scene.camera.rays((8, 8))
    with rt.Tracer(animation.scene, "kd-restart") as tracer:
        alone = tracer.trace(origins, directions)
    for _ in range(3):
        found = workers.trace(animation.scene, origins, directions, "kd-restart")
        assert (found.t == alone.t).all()


def run(words: list[str], capsys) -> tuple[int, str]:
    status = cli.main(["render", *words])
    said = capsys.readouterr()
    return status, said.out + said.err


def test_render_command(tmp_path, monkeypatch, capsys, address: str, precise_renderer) -> None:
    monkeypatch.setattr(sharing, "TILE", 16)
    alone, shared = tmp_path / "alone.png", tmp_path / "shared.png"
    assert run(["cornell", *WORDS, "-o", str(alone)], capsys)[0] == 0
    status, said = run(["cornell", *WORDS, "-o", str(shared), "--scheduler", address], capsys)
    # One worker may be dead, because an earlier test killed it.
    assert status == 0 and re.search("6 of 6 tiles drawn by (1 worker|2 workers);", said)
    assert (np.asarray(Image.open(shared)) == np.asarray(Image.open(alone))).all()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_can_be_sent(name: str) -> None:
    digest(rt.load_animation(name).vertices)


def test_a_motion_that_cannot_be_sent_gives_one_line() -> None:
    with pytest.raises(rt.Error, match="top level of a module"):
        digest(lambda frame: frame)


def interrupted_after(parts: int, monkeypatch) -> None:
    """Interrupts a run, as Ctrl-C does, after ``parts`` tiles or frames are saved."""
    keep = sharing.Unfinished.keep

    def keep_some(self, part: int, image: Image.Image) -> None:
        if len(self._done) == parts:
            raise KeyboardInterrupt
        keep(self, part, image)
    monkeypatch.setattr(sharing.Unfinished, "keep", keep_some)


@pytest.mark.parametrize("shared", [False, True], ids=["one process", "workers"])
@pytest.mark.parametrize("output", ["film.gif", "out_%02d.png", "folder/"])
def test_an_interrupted_run_is_resumed(output: str, shared: bool, tmp_path, capsys, address: str,
                                       precise_renderer) -> None:
    moving(tmp_path / "soup.npz")
    (tmp_path / "at once").mkdir()
    words = [str(tmp_path / "soup.npz"), "--frames", "6", "--size", "16x16"]
    assert run([*words, "-o", os.path.join(tmp_path, "at once", output)], capsys)[0] == 0
    (tmp_path / "here").mkdir()
    words += ["-o", os.path.join(tmp_path, "here", output)]
    with pytest.MonkeyPatch.context() as patch:
        interrupted_after(2, patch)
        status, said = run(words + ["--scheduler", address] * shared, capsys)
    assert status == 130 and "2 of 6 parts are saved; --resume draws the other parts" in said
    status, said = run([*words, "--resume", "--size", "8x8"], capsys)
    assert status == 1 and "parts with another size" in said and said.count("\n") == 1
    # Workers resume a run of a single process, and a single process resumes a run of workers.
    status, said = run([*words, "--resume"] + ["--scheduler", address] * (not shared), capsys)
    assert status == 0 and ("wrote 4 frames" if shared else "4 of 6 frames drawn") in said
    found, expected = ([p for p in sorted((tmp_path / folder).rglob("*")) if p.is_file()]
                       for folder in ("here", "at once"))
    assert [p.name for p in found] == [p.name for p in expected] and found
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(found, expected))


def test_ctrl_c_gives_one_line(tmp_path) -> None:
    """Ctrl-C ends a run with a line that names `--resume`, and without a traceback. All processes
    of a terminal receive Ctrl-C at once, including workers."""
    running = subprocess.Popen(
        [sys.executable, "-c", COMMAND, "render", "cloth", "--frames", "4000", "--size",
         "16x16", "-o", f"{tmp_path}/", "--scheduler", "local"], stderr=subprocess.PIPE,
        text=True, start_new_session=True)
    try:
        end = time.monotonic() + 300
        while len(list(tmp_path.glob("frame_*"))) < 3 and running.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.1)
        os.killpg(running.pid, signal.SIGINT)
        said = running.communicate(timeout=240)[1]
    finally:
        running.kill()
    assert running.returncode == 130
    assert said.splitlines()[-1].endswith("--resume draws the other parts")
    assert "Traceback" not in said and "Process" not in said
    assert (tmp_path / "frames.unfinished").is_dir()


def test_a_lost_scheduler_gives_two_lines(tmp_path) -> None:
    """The run ends with two lines, which say how to resume and that the scheduler ended. In the
    past, Dask logged a traceback after these lines."""
    file, output = tmp_path / "scheduler.json", tmp_path / "out"
    begun: list[subprocess.Popen] = []

    def start(*words: str) -> subprocess.Popen:
        begun.append(subprocess.Popen([sys.executable, *words], stderr=subprocess.PIPE, text=True))
        return begun[-1]

    def until(there: Callable[[], bool]) -> None:
        end = time.monotonic() + 300
        while not there():
            assert time.monotonic() < end and running.poll() is None
            time.sleep(0.1)
    try:
        dask = ["-m", "dask", "ROLE", "--scheduler-file", str(file), "--no-dashboard"]
        running = start(*dask[:2], "scheduler", *dask[3:], "--host", "127.0.0.1", "--port", "0")
        until(file.exists)
        scheduler = running
        start(*dask[:2], "worker", *dask[3:], "--nthreads", "1", "--no-nanny")
        running = start("-c", COMMAND, "render", "cloth", "--frames", "4000", "--size", "16x16",
                        "-o", f"{output}/", "--scheduler", json.loads(file.read_text())["address"])
        until(lambda: len(list(output.glob("frame_*"))) > 2)
        scheduler.kill()
        said = running.communicate(timeout=240)[1].splitlines()
    finally:
        for process in begun:
            process.kill()
            process.communicate()
    assert running.returncode == 1 and len(said) == 2, said
    assert "--resume draws the other parts" in said[0] and "their scheduler ended" in said[1]


def test_tiles_of_an_interrupted_picture_are_kept(tmp_path, monkeypatch, capsys,
                                                  address: str, precise_renderer) -> None:
    monkeypatch.setattr(sharing, "TILE", 16)
    picture, alone = tmp_path / "picture.png", tmp_path / "alone.png"
    words = ["cornell", *WORDS, "-o", str(picture), "--scheduler", address]
    with pytest.MonkeyPatch.context() as patch:
        interrupted_after(4, patch)
        assert run(words, capsys)[0] == 130
    parts = sorted((tmp_path / "picture.png.unfinished").glob("*.png"))
    assert len(parts) == 4 and not picture.exists()
    parts[0].write_bytes(b"spoilt")
    status, said = run([*words, "--resume"], capsys)
    assert status == 0 and "3 of 6 tiles drawn" in said
    assert run(["cornell", *WORDS, "-o", str(alone)], capsys)[0] == 0
    assert (np.asarray(Image.open(picture)) == np.asarray(Image.open(alone))).all()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["alone.png", "picture.png"]


@pytest.mark.parametrize("shared", [False, True], ids=["one process", "workers"])
@pytest.mark.parametrize("resume", [[], ["--resume"]], ids=["anew", "resume"])
def test_two_runs_do_not_write_one_output(resume: list, shared: bool, tmp_path, monkeypatch,
                                          capsys, address: str) -> None:
    """A second run with the same output is refused. In the past, the second run deleted the parts
    of the first run, and both runs failed."""
    words = ["cloth", "--frames", "3", "--size", "8x8", "-o", f"{tmp_path}/%d.png",
             *["--scheduler", address] * shared]
    keep, second = sharing.Unfinished.keep, []

    def keep_while_another_begins(self, part: int, image: Image.Image) -> None:
        keep(self, part, image)
        if not second:
            second.append("begun")
            kept = {file: file.read_bytes() for file in self.folder.iterdir()}
            second[:] = run([*words, *resume], capsys)
            assert {file: file.read_bytes() for file in self.folder.iterdir()} == kept
    monkeypatch.setattr(sharing.Unfinished, "keep", keep_while_another_begins)
    assert run(words, capsys)[0] == 0
    status, said = second
    assert status == 1 and said.count("\n") == 1 and "another run is writing" in said
    assert sorted(p.name for p in tmp_path.iterdir()) == ["0.png", "1.png", "2.png"]


def test_another_run_can_lock_the_output_of_a_killed_run(tmp_path) -> None:
    folder = tmp_path / "a.png.unfinished"
    killed = subprocess.run([sys.executable, "-c", (
        "import os, sys\nfrom pathlib import Path\n"
        "from gpgpu_rt.cli.folder_lock import FolderLock\n"
        "held = FolderLock(Path(sys.argv[1]), Path('a.png'))\nos.kill(os.getpid(), 9)"),
        str(folder)])
    assert killed.returncode == -9 and list(folder.iterdir())
    held = FolderLock(folder, Path("a.png"))
    with pytest.raises(rt.Error, match="another run is writing a.png"):
        FolderLock(folder, Path("a.png"))
    held.release()
    assert not list(folder.iterdir())
    FolderLock(folder, Path("a.png")).release()


def test_a_lock_on_a_deleted_file_does_not_count(tmp_path, monkeypatch) -> None:
    """A run that has locked a file checks that the file still exists in the folder.

    A run claims an output by a lock on a file. The previous owner may delete the file after the
    run has opened it and before the run locks it. A lock on a deleted file excludes nobody.
    """
    folder = tmp_path / "a.unfinished"
    others, lock = [FolderLock(folder, Path("a"))], claim._locked

    def let_go_first(file) -> bool:
        if others:
            others.pop().release()
            folder.rmdir()
        return lock(file)
    monkeypatch.setattr(claim, "_locked", let_go_first)
    held = FolderLock(folder, Path("a"))
    with pytest.raises(rt.Error, match="another run"):
        FolderLock(folder, Path("a"))
    held.release()


@pytest.mark.parametrize("words, message", [
    (["--scheduler", "ADDRESS", "-m", "auto"], "with --scheduler, name the method"),
    (["--scheduler", "ADDRESS", "--statistics"], "leave --scheduler out"),
    (["--scheduler", "ADDRESS", "--explain"], "leave --scheduler out"),
    (["--scheduler", "ADDRESS", "--integrator", "path", "--noise", "0.1"], "give samples"),
    (["--scheduler", "ADDRESS", "--first-hits", "rasterised"], "the whole picture"),
    (["--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler answers"),
    (["--resume"], "--resume needs --frames or --scheduler")])
def test_mistakes_are_one_line_and_leave_nothing(words: list, message: str, tmp_path, monkeypatch,
                                                 capsys, address: str) -> None:
    if "tcp://127.0.0.1:1" in words:
        monkeypatch.setattr("gpgpu_rt.workers.workers.PATIENCE", "2s")
    words = [address if word == "ADDRESS" else word for word in words]
    status, said = run(["cornell", "--size", "8x8", "-o", str(tmp_path / "a.png"), *words], capsys)
    assert status == 1 and message in said and said.count("\n") == 1
    assert not list(tmp_path.iterdir())
