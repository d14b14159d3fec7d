"""Export: the passes of a method, as a description that the page's player runs.

The host draws a few passes and observes them. The description names the programs in GLSL ES, the
tables, and what each pass reads and writes. The player knows no method: it draws the passes in
their order, and repeats the last pass until no ray is alive.
"""
from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from ..errors import OptionError
from ..gl.context import open_gpu
from ..gl.es import es_text
from ..gl.observation import ObservedPass
from ..gl.shader import Compilation, compilations
from ..inspect.program_text import program_text
from ..methods import Method, find_method, methods
from ..scene.scene import Scene
from ..tracer import Tracer
from .structure import structure_of

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
    test : base64 of float32: the directions of the test's rays, and their hits (t, u, v, triangle)
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
        self._known: dict[tuple[Any, ...], int] = {}

    def text(self, text: str) -> int:
        """Return the number of a program's text, in GLSL ES."""
        told = es_text(text)
        if told not in self.texts:
            self.texts.append(told)
        return self.texts.index(told)

    def table(self, texture: moderngl.Texture) -> int:
        """Return the number of a table."""
        data = texture.read()
        key = texture.size, texture.components, texture.dtype, data
        if key not in self._known:
            self._known[key] = len(self.tables)
            values = np.frombuffer(data, {"f4": np.float32, "f2": np.float16}[texture.dtype])
            self.tables.append({"size": list(texture.size), "components": texture.components,
                                "data": packed(values.astype(np.float32))})
        return self._known[key]


def packed(values: np.ndarray) -> str:
    """Return float32 values, compressed by gzip, as base64."""
    return base64.b64encode(gzip.compress(np.ascontiguousarray(values, "<f4").tobytes(), 6,
                                          mtime=0)).decode()


def export_method(scene: Scene, name: str, tables: PageData) -> WebMethod:
    """Return a method of a page, and add its texts and tables to those of the page.

    Raises
    ------
    OptionError
        no schedule of the method runs in a browser
    """
    row, schedules, test, why = find_method(name), {}, {}, ""
    for schedule in SCHEDULES:
        if schedule not in row.schedules:
            continue
        options = {"steps_per_pass": 1} if schedule == "step" and not row.steps_once else {}
        with (compilations(open_gpu()) as compiled,
              Tracer(scene, name, schedule=schedule, **options) as tracer):
            look = _Described(tables, schedule, compiled)
            with tracer.observe(look.look):
                hits = tracer.eye_hits(size=(TEST_SIDE, TEST_SIDE))
            why = look.why_not or why
            if not look.why_not:
                schedules[schedule] = look.described(tracer)
        test = {"side": TEST_SIDE, "eye": [float(x) for x in scene.camera.eye],
                "directions": packed(look.directions), "hits": packed(np.column_stack(
                    [hits.t, hits.u, hits.v, np.where(hits.hit, hits.triangle, -1)]))}
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

    def __init__(self, tables: PageData, schedule: str, compiled: list[Compilation]) -> None:
        self._compiled = compiled
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
                inputs[sampler] = f"table:{self._tables.table(texture)}"
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
                "fragment": self._tables.text(self._printed(one.texts[1])), "uniforms": uniforms,
                "inputs": inputs, "outputs": len(one.outputs)})

    def _printed(self, text: str) -> str:
        """Return the printed form of a compiled text. It is shorter, computes the same bits, and
        is the text that a reader of the page sees."""
        return program_text(next(one.fragment for one in self._compiled
                                 if one.fragment.text == text))

    def described(self, tracer: Tracer) -> dict[str, Any]:
        """Return the description of the schedule."""
        record, step = tracer.precision.layout(tracer.method.state), len(self.told) == 3
        return {"passes": self.told, "repeats": step, "hit": self.told[-1]["outputs"] - 1,
                "state": [[field.name, field.texel, field.swizzle] for field in record.fields]
                if step else [], "structure": structure_of(tracer.method)}
