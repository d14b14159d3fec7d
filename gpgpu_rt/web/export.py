"""Export: the passes of a method, as a description that the page's player runs.

The host draws a few passes and observes them. The description names the programs in GLSL ES, the
tables, and what each pass reads and writes. The player knows no method: it draws the passes in
their order, and repeats the passes of a cycle until no ray is alive.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from ..errors import OptionError
from ..gl.context import open_gpu
from ..gl.es import es_text
from ..gl.shader import compilations
from ..methods import Method, find_method, methods
from ..scene.scene import Scene
from ..tracer import Tracer
from .about import about
from .described import Described, NotInBrowser
from .packing import packed_table

TEST_SIDE = 64      # the page checks TEST_SIDE^2 rays of each method
MOST_PASSES = 20000     # a schedule with more passes for the test rays is too slow for a page
SCHEDULES = ("loop", "step", "kernels")


@dataclass(frozen=True)
class WebMethod:
    """A method on a page.

    Attributes
    ----------
    name, summary, citation : of the method's row
    about : the paragraphs of the method's manual
    schedules : for each schedule that runs in a browser, its passes
    test : the test's rays, and the numbers of the tables of their directions and of their hits,
        which are t, u, v, and the triangle or -1
    """

    name: str
    summary: str
    citation: str
    about: Sequence[str]
    schedules: Mapping[str, Any]
    test: Mapping[str, Any]


def why_not_in_browser(row: Method) -> str:
    """Return why a method does not run on a page; "" if it does."""
    if str(row.glsl).startswith("methods/ray_space/"):
        return "the host builds its table anew for the rays of each call"
    if set(row.schedules) == set(row.drivers) == {"kernels"}:
        return "its host reads lists back between passes, or draws triangles instead of rays"
    return ""


def web_names(names: list[str] | None = None) -> list[str]:
    """Return the methods for a page: the given ones, or every method that runs in a browser.

    Raises
    ------
    OptionError
        a given method does not run in a browser
    """
    for name in names or ():
        if reason := why_not_in_browser(find_method(name)):
            raise OptionError(f"{name} does not run in a browser: {reason}")
    return names or [row.name for row in methods() if not why_not_in_browser(row)]


class PageData:
    """The tables and texts of a page. Equal tables, and equal texts, are stored once."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.tables: list[dict[str, Any]] = []
        self.triangles: dict[str, int] = {}
        self._corners = np.zeros((0, 3, 3), np.float32)
        self._known: dict[tuple[Any, ...], int] = {}

    def text(self, text: str) -> int:
        """Return the number of a program's text, in GLSL ES."""
        told = es_text(text)
        if told not in self.texts:
            self.texts.append(told)
        return self.texts.index(told)

    def scene(self, scene: Scene) -> None:
        """Store the scene's triangles, from which the page makes triangle tables and surfaces.

        ``triangles`` then names three tables: the different corners, the corners of each triangle
        as their numbers, and each triangle's colour, 8 bits each of red, green and blue.
        """
        self._corners = np.ascontiguousarray(scene.triangles, np.float32)
        bits = self._corners.reshape(-1, 3).view("V12").ravel()
        _, first, place = np.unique(bits, return_index=True, return_inverse=True)
        order = np.argsort(first)       # the order of the first use, in which many follow on
        numbers = np.empty(len(order), np.int64)
        numbers[order] = np.arange(len(order))
        colours = np.round(255 * np.clip(scene.colours, 0, 1)).astype(np.int64)
        self.triangles = {
            "vertices": self.values(self._corners.reshape(-1, 3)[first[order]]),
            "corners": self.values(numbers[place].reshape(-1, 3).astype(np.float32)),
            "colours": self.values((colours @ (1, 256, 65536)).astype(np.float32))}

    def values(self, values: np.ndarray, **more: Any) -> int:
        """Return the number of a table of values, (n,) or (n, components) float32."""
        key = values.shape, values.tobytes(), *more.items()
        if key not in self._known:
            self._known[key] = len(self.tables)
            self.tables.append({**more, **packed_table(values)})
        return self._known[key]

    def texture(self, texture: moderngl.Texture) -> int:
        """Return the number of the table in a texture."""
        kind = {"f4": np.float32, "f2": np.float16}.get(texture.dtype)
        if kind is None:
            raise NotInBrowser("a table of the method does not hold floats")
        values = np.frombuffer(texture.read(), kind)
        texels = values.astype(np.float32).reshape(-1, texture.components)
        size = *texture.size, texture.components
        rows = self._triangle_rows(texels)
        return self.values(texels, size=size) if rows is None else self.values(
            rows, size=size, triangles=True)

    def _triangle_rows(self, texels: np.ndarray) -> np.ndarray | None:
        """Return the triangle and the field ``last`` of each row of a triangle table, (n, 2).

        Return None if the texels are not, to the bit, the table that the page makes of these.
        """
        if texels.shape[1] != 4 or not len(self._corners):
            return None
        rows = np.zeros((-(-len(texels) // 3), 3, 4), np.float32)
        rows.reshape(-1, 4)[:len(texels)] = texels
        count = int(np.flatnonzero(rows.any((1, 2)))[-1:].sum()) + 1
        found = rows[:count, :2, 3]
        index = np.clip(np.nan_to_num(found[:, 0]), 0, len(self._corners) - 1).astype(np.int64)
        made = np.zeros_like(rows)
        made[:count, :, :3] = self._corners[index]
        made[:count, :2, 3] = found
        return found if made.tobytes() == rows.tobytes() and (found[:, 0] == index).all() else None


def export_method(scene: Scene, name: str, tables: PageData) -> WebMethod:
    """Return a method of a page, and add its texts and tables to those of the page.

    Raises
    ------
    OptionError
        no schedule of the method runs in a browser
    """
    row, schedules, test, why = find_method(name), {}, {}, ""
    tables.scene(scene)
    for schedule in SCHEDULES:
        if schedule not in row.schedules:
            continue
        options = {"steps_per_pass": 1} if schedule == "step" and not row.steps_once else {}
        with (compilations(open_gpu()) as compiled,
              Tracer(scene, name, schedule=schedule, **options) as tracer):
            with tracer.observe() as passes:
                hits = tracer.eye_hits(size=(TEST_SIDE, TEST_SIDE))
                if schedule == "loop" and row.packet_state is not None:
                    _hand_back(tracer)
            try:
                if len(passes) > MOST_PASSES:
                    raise NotInBrowser(f"{schedule} draws {len(passes):,} passes on this scene")
                with tracer.gpu:
                    found = Described(tracer, passes, TEST_SIDE, tables, compiled)
            except NotInBrowser as reason:
                why = str(reason)
                continue
        schedules[schedule] = found.told()
        test = {"side": TEST_SIDE, "eye": [float(x) for x in scene.camera.eye],
                "directions": tables.values(found.directions),
                "hits": tables.values(np.column_stack([
                    hits.t, hits.u, hits.v, np.where(hits.hit, hits.triangle, -1)
                ]).astype(np.float32))}
    if not schedules:
        raise OptionError(f"{name} does not run in a browser: {why}")
    return WebMethod(name, row.summary, row.citation, about(row), schedules, test)


def _hand_back(tracer: Tracer) -> None:
    """Trace the last call's rays again, and draw the pass that gives packets' hits to rays.

    A call that reads hits to the host needs no such pass, but the page does.
    """
    session = tracer.session
    rays, buffers = session.buffers.of((TEST_SIDE, TEST_SIDE))
    session.driver.run(rays, buffers, tracer.statistics)[0].samplers()
