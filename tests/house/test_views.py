"""Objects show themselves as a line of text, and in a notebook as a table with escaped texts."""
from __future__ import annotations

import base64
import io
import re
import sys
import types
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import views
from gpgpu_rt.cli import progress
from gpgpu_rt.hits import INVALID, STACK_OVERFLOW, UNFINISHED
from gpgpu_rt.scene.sketch import sketch
from gpgpu_rt.statistics import Statistics

EVIL = "<script>alert('1')</script>&\n\"'<b onload=x>"


class Tags(HTMLParser):
    """Collects the tags of a text and the text between them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def picture_of(text: str) -> Image.Image:
    """Returns the picture in a view."""
    found = re.search(r'src="data:image/png;base64,([A-Za-z0-9+/=]+)"', text)
    assert found
    return Image.open(io.BytesIO(base64.b64decode(found[1])))


def hits_of(triangle: list[int], status: list[int], t: list[float], **more) -> rt.Hits:
    zeros = np.zeros(len(t), np.float32)
    return rt.Hits(np.array(t, np.float32), zeros, zeros, np.array(triangle, np.int32),
                   np.array(status, np.uint8), **more)


def named(name: str, **more) -> rt.Scene:
    return rt.Scene.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], name=name, **more)


def test_hits_in_a_line() -> None:
    two = hits_of([4, -1, 2, -1, -1, 7], [0, 0, 0, INVALID, UNFINISHED, STACK_OVERFLOW],
                  [1.5, np.inf, 3.25, np.inf, np.inf, 9])
    assert repr(two) == "Hits(6 rays: 2 hit, 1 miss, 1 invalid, 2 stopped; t 1.5 to 3.25)"
    assert repr(hits_of([-1], [0], [np.inf])) == "Hits(1 ray: 0 hit, 1 miss, 0 stopped)"
    assert repr(hits_of([], [], [])) == "Hits(0 rays: 0 hit, 0 miss, 0 stopped)"


def test_all_hits_in_a_line() -> None:
    with rt.Tracer("cornell", "grid") as tracer:
        camera = tracer.scene.camera
        found = tracer.trace_all([camera.eye], [np.subtract(camera.target, camera.eye)])
    assert repr(found) == f"AllHits(1 ray: {len(found)} hits)" and len(found) > 1


def test_hits_of_an_image_have_a_picture() -> None:
    with rt.Tracer("cornell", statistics=True) as tracer:
        hits = tracer.trace(*tracer.scene.camera.rays((700, 20)))
        flat = tracer.trace(*(part.reshape(-1, 3)
                              for part in tracer.scene.camera.rays((8, 8))))
    text = hits._repr_html_()
    assert "20 x 700" in text and "nodes visited" in text and "per ray" in text
    found = np.asarray(picture_of(text))
    step = 4    # 700 / 4 is at most SIDE
    assert found.shape == (5, 175) and views.SIDE >= 175
    t = hits.image("t")[::step, ::step]
    seen = np.isfinite(t)
    assert (found[seen] >= views.FAR).all() and (found[~seen] == views.MISS).all()
    assert found[t == t[seen].min()].min() == views.NEAR
    assert (np.diff(found[seen].astype(int)[np.argsort(t[seen])]) <= 0).all()
    assert "img" not in Tags(flat._repr_html_()).tags


def test_a_view_of_very_many_rays_looks_at_a_sample() -> None:
    many = (10 ** 6, 10 ** 6)

    def same(value: float, kind: type) -> np.ndarray:
        return np.broadcast_to(np.array(value, kind), many[0] * many[1])
    hits = rt.Hits(same(2.5, np.float32), same(0, np.float32), same(0, np.float32),
                   same(3, np.int32), same(0, np.uint8), steps=same(4, np.int32), shape=many)
    assert repr(hits).startswith("Hits(1,000,000,000,000 rays: about 1,000,000,000,000 hit, ")
    assert picture_of(hits._repr_html_()).width <= views.SIDE
    triangle = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
    found = sketch(np.broadcast_to(triangle, (10 ** 9, 3, 3)),
                   np.broadcast_to(np.float32(0.5), (10 ** 9, 3)), named("a").camera)
    assert np.asarray(found).min() < 255


def test_a_tracer_in_a_line() -> None:
    with rt.Tracer("cornell", "kd-restart") as tracer:
        renderer = tracer.gpu.renderer.split(" (")[0].split("/")[0]
        assert repr(tracer) == f"Tracer(cornell, 32 triangles, kd-restart, loop, {renderer})"
        assert "kd-restart" in tracer._repr_html_()
    assert repr(tracer).endswith(", released)")
    with rt.Tracer("cornell", rt.Choices(rt.Choice("bvh-packet", {"octants": True}),
                                         rt.Choice("grid", {}))) as tracer:
        assert ("bvh-packet for coherent rays, loop, octants=True, grid for incoherent rays, loop"
                in repr(tracer))


def test_statistics_in_a_line() -> None:
    found = Statistics(rays=2048, method="grid", passes=3, trace_seconds=0.0421,
                       build_seconds=1.5, counters={"nodes_visited": 7.25}, queries=12345)
    assert repr(found) == ("Statistics(2,048 rays by grid; 3 passes in 42 ms; built in 1.50 s; "
                           "per ray 7.2 nodes visited)")
    assert "12,345" in found._repr_html_() and "waves" not in found._repr_html_()


def test_scenes_and_animations_in_a_line() -> None:
    moving = rt.load_animation("cloth")
    assert repr(moving) == f"Animation(cloth, {len(moving.scene):,} triangles, no end)"
    assert repr(moving.scene).endswith("1 point light, moving)")
    assert repr(rt.load_scene("cornell")) == (
        "Scene(cornell, 32 triangles, 1 material, 1 point light)")
    assert picture_of(moving._repr_html_()).size == picture_of(moving.scene._repr_html_()).size


def test_a_sketch_shows_what_the_camera_sees() -> None:
    """A red sheet fills the left half, in front of a green sheet that fills the picture."""
    corners = [(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0),
               (-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]
    faces = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    scene = rt.Scene.from_arrays(corners, faces, colours=[(1, 0, 0)] * 2 + [(0, 1, 0)] * 2,
                                 camera=rt.Camera((0, 0, 6), (0, 0, 0), fov=60))
    found = np.asarray(picture_of(scene._repr_html_()).convert("RGB")).astype(int)
    half = found.shape[1] // 2
    red, green = found[:, :half - 2], found[:, half + 2:]
    assert (red[..., 0] > red[..., 1] + 90).mean() > 0.99
    assert (green[..., 1] > green[..., 0] + 90).mean() > 0.99
    for behind in (rt.Camera((0, 0, -9), (0, 0, -99)), rt.Camera((0, 0, 0), (0, 0, 1))):
        assert sketch(scene.triangles, scene.colours, behind).getextrema() == ((255, 255),) * 3
    assert sketch(np.zeros((0, 3, 3)), np.zeros((0, 3)), behind).getextrema()[0] == (255, 255)


def test_names_cannot_inject_markup() -> None:
    scene = named(EVIL, source=EVIL)
    with rt.Tracer(scene, "brute-force") as tracer:
        shown = [scene, tracer, rt.Animation(scene, len), Statistics(choice=EVIL)]
        for thing in shown:
            told = Tags(thing._repr_html_())
            assert set(told.tags) <= {"div", "table", "caption", "b", "tr", "th", "td", "img"}
            assert any("<script>alert('1')</script>" in text for text in told.texts)
            assert "\n" not in repr(thing)
    assert Tags(views.table(EVIL, [(EVIL, "x")])).tags == ["table", "caption", "b", "tr", "th",
                                                           "td"]


def test_pictures_show_themselves() -> None:
    with rt.Tracer("cornell") as tracer:
        assert tracer.render(size=(8, 8))._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize("kernel", [True, False], ids=["notebook", "terminal of IPython"])
def test_progress_is_a_bar_in_a_notebook(monkeypatch, capsys, kernel: bool) -> None:
    pytest.importorskip("tqdm", reason="no tqdm (extra: figures)")
    shell = types.SimpleNamespace(**({"kernel": object()} if kernel else {}))
    monkeypatch.setitem(sys.modules, "IPython",
                        types.SimpleNamespace(get_ipython=lambda: shell))
    assert views.in_notebook() == kernel
    with progress.show_progress("sample", progress.doublings("sample")) as tell:
        tell(3, 4, "noise 5%")
        tell(4, 4)
    err = capsys.readouterr().err
    assert ("4/4" in err and "100%" in err) == kernel     # a terminal gets lines
    assert ("4 of 4 samples" in err) == (not kernel)


def test_outside_of_ipython_there_is_no_notebook(monkeypatch) -> None:
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    assert not views.in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: None))
    assert not views.in_notebook()
