"""Draw a followed ray and the boxes of its nodes or cells over the picture."""
from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from ..scene.camera import Camera
from .layout import Rect
from .overlay import projected
from .ray_path import RayPath, edges_of
from .style import BOX, CHOSEN_BOX, LAST_BOX, OUTLINE, RAY

MOST_BOXES = 80         # a longer path shows only its last MOST_BOXES boxes


def draw_path(path: RayPath, camera: Camera, rect: Rect) -> None:
    """Draw a path behind all panels, in the rectangle of the picture."""
    pen = imgui.get_background_draw_list()
    pen.push_clip_rect(imgui.ImVec2(rect.x, rect.y),
                       imgui.ImVec2(rect.x + rect.width, rect.y + rect.height))
    edges = path.edges()[-MOST_BOXES:]
    parts = [(edges[:-1], BOX, 1.0), (edges[-1:], LAST_BOX, 2.0)]
    if path.place is not None:
        chosen = edges_of(path.place.box[None])
        parts = [(edges, BOX, 1.0), (chosen, OUTLINE, 5.0), (chosen, CHOSEN_BOX, 3.0)]
    for segments, colour, thickness in (*parts, (np.array([[path.origin, path.end]]), RAY, 2.0)):
        at = projected(camera, rect.size, segments) + (rect.x, rect.y)
        for (x0, y0), (x1, y1) in at.tolist():
            pen.add_line(imgui.ImVec2(x0, y0), imgui.ImVec2(x1, y1), colour, thickness)
    pen.pop_clip_rect()
