"""The viewer without a window shows a message for each mistake, and continues with the old
picture."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from windowless import settle

from gpgpu_rt.gl.shader import ROOT
from gpgpu_rt.methods import _TABLE, find_method, register
from gpgpu_rt.viewer import Viewer, moves


@pytest.fixture
def user_method(tmp_path: Path) -> Iterator[str]:
    """Registers a user's own method whose shader has an error; yields the method's name."""
    row = find_method("bvh-threaded")
    broken = tmp_path / "broken.glsl"
    text = (ROOT / str(row.glsl)).read_text()
    broken.write_text(text.replace("void init", "void oops(", 1) + "\nthis is no GLSL\n")
    register(replace(row, name="users-own", glsl=broken))
    yield "users-own"
    del _TABLE["users-own"]


def test_errors_are_shown_and_the_picture_stays(viewer: Viewer, user_method: str,
                                                tmp_path: Path) -> None:
    settle(viewer)
    before, image = viewer.selection, viewer.image
    torn = tmp_path / "torn.obj"
    torn.write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    empty = tmp_path / "empty.obj"
    empty.write_text("")
    noise = tmp_path / "noise.ply"
    noise.write_bytes(bytes(range(256)))
    tries = [lambda: viewer.open(tmp_path / "missing.ply"), lambda: viewer.open(torn),
             lambda: viewer.open(empty), lambda: viewer.open(noise),
             lambda: viewer.choose(viewer.selection.with_method(user_method)),
             lambda: viewer.choose(replace(viewer.selection, method="geometry-image",
                                           options={"level": 10 ** 6}))]
    for number, attempt in enumerate(tries):
        attempt()
        assert viewer.busy and not viewer.step(), "the work was not announced first"
        viewer.step()
        assert viewer.message and "\n" not in viewer.message, number
        assert viewer.selection == before and viewer.image is image, viewer.message
        viewer.camera = moves.orbit(viewer.camera, 0.2, 0.0)
        assert viewer.step(), "the viewer no longer draws"
        viewer.reset_camera()
        settle(viewer)
        assert (viewer.image == image).all()
        image = viewer.image
    assert viewer.gpu.context.error == "GL_NO_ERROR"


def test_after_an_error_the_viewer_does_not_draw_again(viewer: Viewer,
                                                       monkeypatch) -> None:
    """After an error, the viewer shows the error's message and does not draw again by itself."""
    calls = []

    def fail(*given, **options):
        calls.append(given)
        raise RuntimeError("lost\nthe device")

    monkeypatch.setattr(viewer.tracer, "render", fail)
    viewer.clock.now += 1
    for _ in range(5):
        viewer.step()
    assert len(calls) == 1 and viewer.message == "RuntimeError: lost the device"


def test_a_registered_method_can_be_chosen(viewer: Viewer) -> None:
    """The viewer can choose and draw a method that is only registered."""
    settle(viewer)
    register(replace(find_method("grid"), name="users-grid"))
    try:
        viewer.choose(viewer.selection.with_method("users-grid"))
        settle(viewer)
        assert viewer.selection.method == "users-grid" == viewer.tracer.method.name
        assert "--method=users-grid" in viewer.command and not viewer.message
    finally:
        del _TABLE["users-grid"]
