"""Graphs: draws graphs of the costs of the last pictures."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui

from ..text_format import counted
from .model import Viewer
from .widgets import quiet, room, tip

HEIGHT = 40      # height of a graph, pixels
TIPS = {"ms": "milliseconds that each of the last pictures took",
        "rays": "millions of rays traced in a second, for the last pictures",
        "passes": "number of passes of each of the last pictures",
        "live": "number of live rays (rays that have not ended), each time the schedule counts "
                "them; only step and kernels count them"}


def draw_graphs(viewer: Viewer) -> None:
    """Draw graphs of the last pictures. In the mode "passes", draw only the live rays of the
    journey (journey.py), because a journey's times include the storing of states."""
    history, journey = list(viewer.history), viewer.journey
    if viewer.mode == "passes":
        if journey is not None:
            _graph("live", "live rays, pass by pass", journey.live, room())
        return
    if not history:
        return quiet("no picture yet")
    last = history[-1]
    half = (room() - imgui.get_style().item_spacing.x) / 2
    for k, (name, now, values) in enumerate((
            ("ms", f"{last.seconds * 1e3:.0f} ms", [one.seconds for one in history]),
            ("rays", f"{last.rays_per_second / 1e6:.2f} M rays/s",
             [one.rays_per_second for one in history]),
            ("passes", counted(last.passes, "pass"), [one.passes for one in history]),
            ("live", "live rays" if last.live else "live rays: not counted", last.live))):
        if k % 2:
            imgui.same_line()
        _graph(name, now, values, half)


def _graph(name: str, now: str, values: Sequence[float] | np.ndarray, width: float) -> None:
    numbers = np.asarray(values if len(values) else [0.0], np.float32)
    top = float(numbers.max())
    imgui.plot_lines(f"##{name}", numbers, overlay_text=now, scale_min=0.0,
                     scale_max=1.1 * top or 1.0, graph_size=imgui.ImVec2(width, HEIGHT))
    tip(TIPS[name])
