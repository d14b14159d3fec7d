"""Costs: the steps and nodes of a method's test rays, by which a reader compares methods."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..scene.scene import Scene
from ..tracer import Tracer


def ray_costs(scene: Scene, name: str, side: int) -> dict[str, Any]:
    """Return the costs of ``side`` x ``side`` eye rays, ready for JSON.

    Returns
    -------
    ``steps`` and ``nodes`` are (mean, largest) per ray; ``nodes`` is None for a method without
    nodes. ``ray`` is the position, across and down from 0 to 1, of the ray with the most steps.
    ``step`` is the step at which the page opens: the median number of steps of the rays that hit,
    but at most half of the largest number of steps of a ray.
    """
    with Tracer(scene, name, statistics=True) as tracer:
        hits = tracer.trace(*scene.camera.rays((side, side)))
    longest = int(np.argmax(hits.steps))
    searching = hits.steps[hits.hit] if hits.hit.any() else hits.steps
    step = min(int(np.median(searching)), int(hits.steps.max()) // 2)
    return {"steps": _summary(hits.steps),
            "nodes": _summary(hits.nodes_visited) if hits.nodes_visited.any() else None,
            "ray": [(longest % side + 0.5) / side, (longest // side + 0.5) / side],
            "step": max(1, step)}


def _summary(counts: np.ndarray) -> tuple[float, int]:
    return round(float(counts.mean()), 2), int(counts.max())
