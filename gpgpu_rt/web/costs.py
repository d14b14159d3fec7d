"""Costs: the steps and nodes of a method's test rays, by which a reader compares methods."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..gl.observation import ObservedPass
from ..inspect.observe import observe_states
from ..methods import find_method
from ..rays.records import HIT
from ..scene.scene import Scene
from ..tracer import Tracer
from ..traversal.driver import DONE


def ray_costs(scene: Scene, name: str, side: int) -> dict[str, Any]:
    """Return the costs of ``side`` x ``side`` eye rays, ready for JSON.

    Returns
    -------
    ``steps`` and ``nodes`` are (mean, largest) per ray; ``nodes`` is None for a method without
    nodes. ``ray`` is the position, across and down from 0 to 1, of the ray with the most steps. If
    several rays have the most steps, a ray that hits is preferred. ``step`` is the position of the
    page's slider after which at least half of the hits are found. ``step`` is None if there is no
    hit, or if the search ends at this position. The page then opens with the finished picture.
    """
    with Tracer(scene, name, statistics=True) as tracer:
        hits = tracer.trace(*scene.camera.rays((side, side)))
    longest = int(np.argmax(2 * hits.steps + hits.hit))
    row = find_method(name)
    packets = row.packet_state is not None and "step" in row.schedules
    ends = _ends_of_packets(scene, name, side) if packets else hits.steps
    return {"steps": _summary(hits.steps),
            "nodes": _summary(hits.nodes_visited) if hits.nodes_visited.any() else None,
            "ray": [(longest % side + 0.5) / side, (longest // side + 0.5) / side],
            "step": _opening_step(ends, hits.hit)}


def _opening_step(ends: np.ndarray, hit: np.ndarray) -> int | None:
    """Return the position at which half of the hits are found, or None. ``ends`` holds the
    position after which each ray has ended."""
    if not hit.any():
        return None
    step = int(np.ceil(np.median(ends[hit])))
    return step if 1 <= step < ends.max() else None


def _ends_of_packets(scene: Scene, name: str, side: int) -> np.ndarray:
    """Return how often the passes of ``step`` are repeated until each ray's packet has ended. A
    packet's number of steps is smaller, because a push or pop is not counted as a step."""
    live: list[np.ndarray] = []

    def look(one: ObservedPass) -> None:
        assert one.target is not None
        if HIT.name not in one.target.records:      # the target of a pass over packets
            phase = one.target.fields(state)["phase"].reshape(one.target.size[::-1])
            live.append(phase > DONE)

    with Tracer(scene, name, schedule="step") as tracer:
        state = tracer.method.state.name
        with observe_states(tracer, look):
            tracer.eye_hits(size=(side, side))
    ends = np.sum(live, 0)
    across = np.arange(side) * ends.shape[1] // side
    down = np.arange(side) * ends.shape[0] // side
    return ends[down[:, None], across].reshape(-1)


def _summary(counts: np.ndarray) -> tuple[float, int]:
    return round(float(counts.mean()), 2), int(counts.max())
