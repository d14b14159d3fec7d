"""The viewer's window works for a person: the tests run the viewer under Xvfb, press keys and move
the mouse with xdotool, and take screenshots.

The tests belong to the full suite, because the window, its context and its programs take seconds
to start on a software renderer.
"""
from __future__ import annotations

import importlib.util
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image, ImageGrab, features

from gpgpu_rt.cli import main

MISSING = [
    *(name for name in ("Xvfb", "xdotool") if shutil.which(name) is None),
    *(name for name in ("moderngl_window", "imgui_bundle", "glfw")
      if importlib.util.find_spec(name) is None),
    *([] if features.check("xcb") else ["Pillow with XCB"])]
pytestmark = [pytest.mark.full, pytest.mark.once, pytest.mark.skipif(
    bool(MISSING), reason=f"the window is not tested: no {', '.join(MISSING)}")]
SIZE = (640, 480)
# Points in the left panel. METHODS lies in the list of methods, and COSTS in the heading of the
# graphs. If the graphs are folded, LAST lies in the last heading, and FILE in its text field.
METHODS, COSTS, LAST, FILE = (150, 44), (150, 198), (150, 302), (200, 328)
PATIENCE = 240.0  # seconds; long enough for a busy machine
CLIENT = Path(__file__).with_name("x_client.py")
START = "import sys; from gpgpu_rt.cli import main; sys.exit(main(sys.argv[1:]))"
# This program registers a user's own method as the last row of the table. The method's shader has
# an error.
BROKEN = """
import dataclasses, sys
from gpgpu_rt.cli import main
from gpgpu_rt.methods import find_method, register
register(dataclasses.replace(find_method("bvh-threaded"), name="users-own", glsl=sys.argv.pop(1)))
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """Starts an X server with one screen, and yields the display's name."""
    reader, writer = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(writer), "-screen", "0", "1024x768x24",
                               "-nolisten", "tcp"], pass_fds=[writer], stderr=subprocess.DEVNULL)
    os.close(writer)
    with os.fdopen(reader) as told:
        name = ":" + told.readline().strip()
    yield name
    server.terminate()
    server.wait()


class Person:
    """A person in front of the viewer's window."""

    def __init__(self, display: str, folder: Path, *words: str, code: str = START,
                 before: tuple[str, ...] = ()) -> None:
        self.display, self.folder = display, folder
        self.environment = {**os.environ, "DISPLAY": display}
        self.out = (folder / "out.json").open("w+")
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, *before, "view", *words, "--json", "--folder",
             str(folder), "--size", "x".join(map(str, SIZE))], env=self.environment,
            stdout=self.out, stderr=subprocess.PIPE, text=True)
        self.window = self.xdotool("search", "--sync", "--name", "^gpgpu-rt").split()[0]
        self.settled()

    def xdotool(self, *words: str) -> str:
        assert self.process.poll() is None, self.process.stderr.read()
        return subprocess.run(["xdotool", *words], env=self.environment, capture_output=True,
                              text=True, timeout=PATIENCE, check=True).stdout

    def desktop(self, what: str, *words: str) -> None:
        """Acts like a window manager or a file manager: drops a file, or closes the window."""
        subprocess.run([sys.executable, str(CLIENT), what, self.window, *words],
                       env=self.environment, check=True, timeout=PATIENCE)

    def key(self, *keys: str) -> None:
        for key in keys:
            self.xdotool("key", key)
            time.sleep(0.3)

    def drag(self, start: tuple[int, int], by: tuple[int, int], steps: int = 12) -> None:
        self.xdotool("mousemove", *map(str, start))
        time.sleep(0.5)
        self.xdotool("mousedown", "1")
        for _ in range(steps):
            self.xdotool("mousemove_relative", "--", str(by[0] // steps), str(by[1] // steps))
            time.sleep(0.05)
        self.xdotool("mouseup", "1")

    def click(self, x: int, y: int) -> None:
        self.xdotool("mousemove", str(x), str(y))
        time.sleep(0.5)
        self.xdotool("click", "1")

    def open_headings(self) -> None:
        """Folds the graphs and opens the last heading, which has the text field for a file."""
        for place in (COSTS, LAST):
            self.click(*place)
            self.settled()

    def screen(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """Returns the screen's pixels, (h, w, 3) uint8."""
        grabbed = ImageGrab.grab(bbox=(0, 0, *size), xdisplay=self.display)
        return np.asarray(grabbed.convert("RGB"))

    def settled(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """Waits until the title says that the picture is complete and the pixels stay the same.
        Returns the screen.

        On a slow machine the viewer may show only a coarse picture. The person then presses Return
        to ask for the fine picture.
        """
        began, last, same = time.monotonic(), self.screen(size), 0
        while same < 3:
            assert time.monotonic() - began < PATIENCE, "the picture never settles"
            time.sleep(0.5)
            title = self.xdotool("getwindowname", self.window).strip()
            if title.endswith("(coarse)"):
                self.key("Return")
            now = self.screen(size)
            done = title.startswith("gpgpu-rt: ") and not title.endswith(("...", "(coarse)"))
            same = same + 1 if done and (now == last).all() else 0
            last = now
        return last

    def quit(self, by_key: bool = True) -> dict:
        """Closes the window and returns the printed JSON. The process must end with status 0."""
        if by_key:
            self.key("ctrl+q")
        else:
            self.desktop("close")
        assert self.process.wait(timeout=PATIENCE) == 0, self.process.stderr.read()
        assert self.process.stderr.read() == ""
        self.out.seek(0)
        return json.load(self.out)

    def leave(self) -> None:
        """Ends the process in any case."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.out.close()


@pytest.fixture
def person(display: str, tmp_path: Path) -> Iterator:
    people = []

    def sits_down(*words: str, **more) -> Person:
        people.append(Person(display, tmp_path, *words, **more))
        return people[-1]

    yield sits_down
    for one in people:
        one.leave()


def test_looking_around_and_the_command_for_the_same_picture(person, tmp_path: Path) -> None:
    one = person("teapot", "-m", "kd-restart")
    helped = one.settled()
    one.key("h")
    assert (one.settled() != helped).any(), "h does not hide the help"
    one.key("Tab")
    first = one.settled()
    one.drag((400, 200), (144, 36))
    turned = one.settled()
    assert (turned != first).any(axis=2).mean() > 0.05
    one.key("m")
    assert (one.settled() == turned).mean() > 0.99, "another method draws another picture"
    one.key("p")
    one.settled()
    one.key("Escape")
    shown = one.settled()
    found = one.quit()
    assert found["settings"]["method"] == "kd-backtrack" and found["pictures_while_moving"] > 0
    assert found["seconds_to_full_quality"], "the picture did not settle"
    again = tmp_path / "again.png"
    words = shlex.split(found["settings"]["command"])
    assert main([*words[1:-1], f"--output={again}"]) == 0
    assert (np.asarray(Image.open(again)) == shown).all()
    saved = np.asarray(Image.open(tmp_path / "teapot-kd-backtrack-1.png"))
    assert (saved == shown).all()


def test_passes_heat_and_the_path_of_a_ray(person) -> None:
    one = person("cornell", "-m", "grid")
    one.key("h", "Tab")
    seen = [one.settled()]
    one.key("2")
    seen.append(one.settled())
    one.key("3")
    seen.append(one.settled())
    one.key("Right", "Right", "Right")
    seen.append(one.settled())
    one.key("Left", "Left", "Left")
    assert (one.settled() == seen[2]).all(), "going back shows another pass"
    one.key("1")
    assert (one.settled() == seen[0]).all()
    one.click(320, 240)
    seen.append(one.settled())
    for k, a in enumerate(seen):
        for b in seen[:k]:
            assert (a != b).any(axis=2).mean() > 0.01
    found = one.quit()
    assert not found["message"] and found["settings"]["mode"] == "picture"
    assert not found["seconds_to_full_quality"], "a move was timed although the camera stood still"


def test_the_lists_of_the_panel(person) -> None:
    one = person("cornell")
    one.key("h")
    one.settled()
    one.click(*METHODS)
    one.settled()
    one.click(METHODS[0], METHODS[1] + 66)      # a row of the open list
    one.settled()
    found = one.quit()
    assert found["settings"]["method"] != "bvh-threaded", "nothing was chosen"


def test_keys_typed_into_a_busy_window_are_no_shortcuts(person, tmp_path: Path) -> None:
    """Keys typed while the window is busy go to the text field, not to shortcuts. The test stops
    the process, as if a frame built a structure for a long time."""
    one = person("cornell")
    one.key("h")
    one.settled()
    one.open_headings()
    one.process.send_signal(signal.SIGSTOP)
    one.click(*FILE)
    one.xdotool("type", "--delay", "50", "mp3")
    one.process.send_signal(signal.SIGCONT)
    one.settled()
    found = one.quit()
    assert found["settings"]["method"] == "bvh-threaded", (
        "the typed m acted as the shortcut for the next method")
    assert found["settings"]["mode"] == "picture" and not list(tmp_path.glob("*.png"))


def test_keys_are_no_shortcuts_while_a_list_is_open(person) -> None:
    """While a list is open, keys are not shortcuts, and Escape closes the list."""
    one = person("cornell")
    one.key("h")
    one.xdotool("mousemove", "500", "300")
    closed = one.settled()
    one.click(*METHODS)
    assert (one.settled() != closed).any()
    one.key("m", "3", "h", "Tab")
    one.settled()
    one.key("Escape")
    one.xdotool("mousemove", "500", "300")
    assert (one.settled() == closed).mean() > 0.99, "Escape does not close the list"
    found = one.quit()
    assert found["settings"]["method"] == "bvh-threaded"
    assert found["settings"]["mode"] == "picture"


@pytest.mark.parametrize("file", ["torn.obj", "noise.ply"])
def test_a_broken_file_dropped_is_an_error_on_the_screen(person, tmp_path: Path,
                                                         file: str) -> None:
    (tmp_path / "torn.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "noise.ply").write_bytes(bytes(range(256)))
    one = person("cornell")
    one.key("h")
    before = one.settled()
    one.desktop("drop", str(tmp_path / file))
    said = one.settled()
    assert (said[:40, 320:] != before[:40, 320:]).any(), "no error is shown"
    one.drag((450, 250), (60, 24))
    assert (one.settled()[60:400, 300:] != before[60:400, 300:]).any(), "the picture is frozen"
    found = one.quit()
    assert file.partition(".")[0] in found["message"]
    assert found["settings"]["scene"] == "cornell"


def test_a_mesh_is_dropped_and_a_path_typed(person, tmp_path: Path) -> None:
    mesh = tmp_path / "ball.ply"
    trimesh.creation.icosphere(subdivisions=2).export(mesh)
    one = person("cornell")
    one.key("h", "Tab")
    before = one.settled()
    one.desktop("drop", str(mesh))
    dropped = one.settled()
    assert (dropped != before).any(axis=2).mean() > 0.3
    one.key("Tab")
    one.settled()
    one.open_headings()
    one.click(*FILE)
    one.settled()
    one.xdotool("type", "--delay", "100", "cornell")
    one.settled()
    one.key("Return")
    one.settled()
    one.key("Escape", "Tab")
    one.click(500, 240)  # leave the text field before pressing the key that quits
    one.settled()
    found = one.quit()
    assert found["settings"]["scene"] == "cornell" and not found["message"]


def test_resizing_hiding_and_a_broken_shader_do_not_end_the_viewer(person, tmp_path: Path) -> None:
    glsl = tmp_path / "broken.glsl"
    glsl.write_text("// Nobody 2026\nthis is no GLSL\n")
    one = person("cornell", "-m", "brute-force", code=BROKEN, before=(str(glsl),))
    one.key("h", "Tab")
    before = one.settled()
    one.key("shift+m")
    one.settled()
    one.key("Escape")
    assert (one.settled() == before).all(), "the picture changed"
    for size in ((900, 600), (60, 40), (330, 700)):
        one.xdotool("windowsize", one.window, *map(str, size))
        time.sleep(2)
        one.settled(size)
    one.xdotool("windowunmap", one.window)
    time.sleep(2)
    one.xdotool("windowmap", one.window)
    time.sleep(2)
    one.xdotool("windowsize", one.window, *map(str, SIZE))
    time.sleep(2)
    assert (one.settled() == before).all()
    one.key("shift+m")
    one.settled()
    found = one.quit(by_key=False)
    assert "error" in found["message"] and "[defines" in found["message"]
    assert found["settings"]["method"] == "brute-force"
