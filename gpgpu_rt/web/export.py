"""Export: the passes of a method, as a description that the page's player runs.

The host draws a few passes and observes them. The description names the programs in GLSL ES, the
tables, and what each pass reads and writes. The player knows no method: it draws the passes in
their order, and repeats the last pass until no ray is alive.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from ..errors import OptionError
from ..gl.es import es_text
from ..gl.observation import ObservedPass
from ..methods import Method, find_method, methods
from ..scene.scene import Scene
from ..tracer import Tracer
from .packing import packed_table

TEST_SIDE = 64      # the page checks TEST_SIDE^2 rays of each method
MOST_TARGETS = 4    # render targets that every WebGL 2 offers
SCHEDULES = ("loop", "step")
_EYE = "drivers/eye_rays.frag"
_CAMERA = ("eye", "right", "up", "forward", "size")


@dataclass(frozen=True)
class WebMethod:
    """A method on a page.

    Attributes
    ----------
    name, summary, citation : of the method's row
    schedules : for each schedule that runs in a browser, its passes
    test : the test's rays, and the numbers of the tables of their directions and of their hits,
        which are t, u, v, and the triangle or -1
    """

    name: str
    summary: str
    citation: str
    schedules: Mapping[str, Any]
    test: Mapping[str, Any]


def why_not_in_browser(row: Method) -> str:
    """Return why a method does not run on a page; "" if it does."""
    if row.packet or row.single:
        return ("its packets, or its stack of a packet of one ray, need programs that join names, "
                "and more targets than WebGL 2 promises")
    if row.glsl.startswith("methods/ray_space/"):
        return "the host builds its table anew for the rays of each call"
    if row.stack_entry is not None:
        return "its stack lies in a texture that other passes write"
    if not set(SCHEDULES) & set(row.schedules):
        return "its passes need occlusion queries that return counts, which WebGL 2 lacks"
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
        values = np.frombuffer(texture.read(), {"f4": np.float32, "f2": np.float16}[texture.dtype])
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
        with Tracer(scene, name, schedule=schedule, **options) as tracer:
            look = _Described(tables, schedule)
            with tracer.observe(look.look):
                hits = tracer.eye_hits(size=(TEST_SIDE, TEST_SIDE))
            why = look.why_not or why
            if not look.why_not:
                schedules[schedule] = look.described(tracer)
        test = {"side": TEST_SIDE, "eye": [float(x) for x in scene.camera.eye],
                "directions": tables.values(look.directions.reshape(-1, 4)),
                "hits": tables.values(np.column_stack([
                    hits.t, hits.u, hits.v, np.where(hits.hit, hits.triangle, -1)
                ]).astype(np.float32))}
    if not schedules:
        raise OptionError(f"{name} does not run in a browser: {why}")
    return WebMethod(name, row.summary, row.citation, schedules, test)


class _Described:
    """Describes the passes of a schedule while their textures hold what the passes read: the eye
    rays, the set-up of states, and the repeated pass.

    Attributes
    ----------
    directions : float32, of the eye rays
    told : the passes, ready for JSON
    why_not : why the schedule does not run in a browser, or ""
    """

    def __init__(self, tables: PageData, schedule: str) -> None:
        self.directions, self.told, self.why_not = np.zeros(0, np.float32), [], ""
        self._tables, self._sources = tables, {}
        self._loops = schedule == "loop"
        self._wanted = [_EYE, *(["all"] if schedule == "loop" else ["init", "all"])]

    def look(self, one: ObservedPass) -> None:
        """Describe a pass, if it is the next of the wanted passes."""
        if not self._wanted and self._loops and one.kernel == "all":
            self.why_not = "a ray takes more steps than a loop has on this scene"
        if not self._wanted or self._wanted[0] not in (one.name, one.kernel):
            return
        self._wanted.pop(0)
        if one.name == _EYE:
            self.directions = np.frombuffer(one.outputs[1].read(), np.float32)
        self._describe(one)
        group = "rays" if one.name == _EYE else "previous"
        self._sources.update({texture.glo: f"{group}:{k}"
                              for k, texture in enumerate(one.outputs)})

    def _describe(self, one: ObservedPass) -> None:
        inputs = {}
        for sampler, texture in one.inputs.items():
            if texture.glo in self._sources:
                inputs[sampler] = self._sources[texture.glo]
            elif sampler.endswith("_table"):
                inputs[sampler] = f"table:{self._tables.texture(texture)}"
            else:
                self.why_not = f"another program than the traversal writes {sampler}"
        if len(one.outputs) > MOST_TARGETS:
            self.why_not = f"a pass has more than {MOST_TARGETS} render targets"
        # The player sets the camera, and the eye in the place of the rays' shared origin.
        uniforms = {name: np.asarray(value, float).ravel().tolist()
                    for name, value in one.uniforms.items()
                    if name not in (*_CAMERA, "rays_texel_0")}
        if not self.why_not:
            self.told.append({
                "name": one.label, "vertex": self._tables.text(one.texts[0]),
                "fragment": self._tables.text(one.texts[1]), "uniforms": uniforms,
                "inputs": inputs, "outputs": len(one.outputs)})

    def described(self, tracer: Tracer) -> dict[str, Any]:
        """Return the description of the schedule."""
        record, step = tracer.precision.layout(tracer.method.state), len(self.told) == 3
        return {"passes": self.told, "repeats": step, "hit": self.told[-1]["outputs"] - 1,
                "state": [[field.name, field.texel, field.swizzle] for field in record.fields]
                if step else []}
