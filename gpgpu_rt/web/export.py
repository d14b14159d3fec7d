"""Export: describes the passes of a method, for the player on a page.

The host traces TEST_SIDE^2 eye rays and observes all passes. The description names the programs in
GLSL ES, the tables, and what each pass reads and writes. One player (player.js, passes.js) runs
all methods.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import OptionError
from ..gl.context import open_gpu
from ..gl.shader import compilations
from ..inspect.time_travel import one_pass_alone
from ..methods import Method, find_method, methods
from ..scene.scene import Scene
from ..tracer import Tracer
from .about import about
from .costs import ray_costs
from .described import Described
from .page_data import NotInBrowser, PageData

TEST_SIDE = 64      # the page checks TEST_SIDE^2 rays of each method
MOST_TEST_PASSES = 20000     # a schedule with more passes for the test rays is too slow for a page
SCHEDULES = ("loop", "step", "kernels")


@dataclass(frozen=True)
class WebMethod:
    """A method on a page.

    Attributes
    ----------
    name, summary, citation : as in the method's row of the method table
    about : the paragraphs of the method's manual
    schedules : schedule -> its passes, for all schedules that run in a browser
    test : the image's ``side``, the ``eye``, and the indices of two tables of `PageData`:
        ``directions`` of the test's rays, and ``hits`` (t, u, v, and the triangle or -1)
    no_path : ``""``, or the reason why the page shows no path of a ray
    costs : the steps and nodes of the test's rays, from `ray_costs`
    """

    name: str
    summary: str
    citation: str
    about: Sequence[str]
    schedules: Mapping[str, Any]
    test: Mapping[str, Any]
    no_path: str
    costs: Mapping[str, Any]

    @property
    def has_steps(self) -> bool:
        """Whether the page shows the steps of the search: ``loop`` has no steps to show."""
        return any(one["repeats"] for one in self.schedules.values())


def why_not_in_browser(row: Method) -> str:
    """Return why a method does not run on a page; "" if the method runs."""
    if "kernels" not in row.drivers:
        return ""
    if row.schedules == ("kernels",):
        return "its host reads lists back between passes, or draws triangles instead of rays"
    return "the host builds the method's table anew for the rays of each call"


def _why_no_path(row: Method, left_out: Mapping[str, str]) -> str:
    """Return why a page shows no path of a ray; "" if the page shows the path. ``left_out`` maps
    each schedule that does not run on the page to the reason."""
    if row.schedules == ("loop",):
        return one_pass_alone(row)
    packets = f"method {row.name} traces packets, and a state belongs to all rays of a packet"
    return left_out.get("step", packets if row.packet else "")


def web_names(names: list[str] | None = None) -> list[str]:
    """Return the methods' names for a page: ``names``, or all methods that run in a browser.

    Raises
    ------
    OptionError
        if a given method does not run in a browser
    """
    for name in names or ():
        if reason := why_not_in_browser(find_method(name)):
            raise OptionError(f"{name} does not run in a browser: {reason}")
    return names or [row.name for row in methods() if not why_not_in_browser(row)]


def export_method(scene: Scene, name: str, tables: PageData) -> WebMethod:
    """Return a method's description for a page. Add its texts and tables to ``tables``.

    Raises
    ------
    OptionError
        if no schedule of the method runs in a browser
    """
    row, schedules, test, left_out = find_method(name), {}, {}, {}
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
                if len(passes) > MOST_TEST_PASSES:
                    raise NotInBrowser(f"{schedule} draws {len(passes):,} passes on this scene")
                with tracer.gpu:
                    found = Described(tracer, passes, TEST_SIDE, tables, compiled)
            except NotInBrowser as reason:
                left_out[schedule] = str(reason)
                continue
        schedules[schedule] = found.told()
        test = {"side": TEST_SIDE, "eye": [float(x) for x in scene.camera.eye],
                "directions": tables.values(found.directions),
                "hits": tables.values(np.column_stack([
                    hits.t, hits.u, hits.v, np.where(hits.hit, hits.triangle, -1)
                ]).astype(np.float32))}
    if not schedules:
        raise OptionError(f"{name} does not run in a browser: {[*left_out.values()][-1]}")
    return WebMethod(name, row.summary, row.citation, about(row), schedules, test,
                     _why_no_path(row, left_out), ray_costs(scene, name, TEST_SIDE))


def _hand_back(tracer: Tracer) -> None:
    """Trace the last call's rays again, now with the pass that copies hits from packets to rays.

    The page needs this pass. The tracer itself reads the hits without it.
    """
    session = tracer.session
    rays, buffers = session.buffers.of((TEST_SIDE, TEST_SIDE))
    session.driver.run(rays, buffers, tracer.statistics)[0].samplers()
