"""A ray's path: what one ray does pass by pass, as rows of a table and as boxes in space."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..inspect.pass_pictures import PLACES
from ..inspect.time_travel import Pass, phase_names, travel
from ..methods.grid.cells import Grid
from ..scene.camera import Camera
from ..text_format import counted
from ..tracer import Tracer
from .journey import hit_words, word_of

MOST_ROWS = 20_000
# Corners of a box as bits of their number, and the pairs that an edge joins.
_EDGES = np.array([(a, a | 1 << axis) for a in range(8) for axis in range(3)
                   if not a >> axis & 1])


@dataclass
class RayPath:
    """What became of the ray through a pixel.

    Attributes
    ----------
    pixel : (x, y) of the picture, row 0 at the top
    columns, rows : a row a pass: pass, kernel that ran, what the ray waits for, its fields
    origin, end : (3,) where it starts and where it hits, or where it leaves what is there
    boxes : (k, 2, 3) lower and upper corners of the nodes or cells it was in, in their order;
        none where a method's structure has no boxes of its own
    hit : the triangle, or -1
    count : passes, of which the first MOST_ROWS have rows
    """

    pixel: tuple[int, int]
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    origin: np.ndarray
    end: np.ndarray
    boxes: np.ndarray
    hit: int
    count: int

    def title(self) -> str:
        """Whose path it is, how long, and what the ray hits."""
        rows = counted(self.count, "pass")
        if self.count > len(self.rows):
            rows = f"the first {len(self.rows):,} of {rows}"
        return (f"the ray of pixel {self.pixel[0]}, {self.pixel[1]}: {rows}, "
                + (f"triangle {self.hit}" if self.hit >= 0 else "nothing"))

    def edges(self) -> np.ndarray:
        """(k, 12, 2, 3): the edges of the boxes, for drawing."""
        bits = (np.arange(8)[:, None] >> np.arange(3)) & 1                # (8, 3)
        corners = np.where(bits[None] == 1, self.boxes[:, 1:], self.boxes[:, :1])
        return corners[:, _EDGES]


def follow(tracer: Tracer, camera: Camera, size: tuple[int, int],
           pixel: tuple[int, int]) -> RayPath:
    """Trace the ray through a pixel alone and note its state after each pass.

    Parameters
    ----------
    tracer : under ``step`` with one step a pass, or ``kernels``
    size : (width, height) pixels of the picture
    pixel : (x, y), row 0 at the top
    """
    x, y = pixel
    origins, directions = (part[y:y + 1, x:x + 1] for part in camera.rays(size))
    names = phase_names(tracer)
    passes: list[Pass] = []
    count = 0

    def look(one: Pass) -> None:    # passes that served other kernels tell nothing new
        nonlocal count
        if one.served or not passes:
            count += 1
            if len(passes) < MOST_ROWS:
                passes.append(one)

    hits = travel(tracer, origins, directions, look)
    fields = [name for name in passes[0].state if name not in ("phase", "steps")]
    rows = []
    for one in passes:
        phase = int(one.state["phase"][0])
        rows.append((str(one.number), " ".join(one.served) or one.kernel,
                     names.get(phase, str(phase)),
                     *(word_of(one.state[name][0]) for name in fields),
                     *(hit_words(one, 0)[name] for name in ("t", "triangle"))))
    origin, direction = origins[0, 0].astype(np.float64), directions[0, 0].astype(np.float64)
    lo, hi = tracer.scene.bounds
    far = float(np.linalg.norm(np.maximum(np.abs(lo - origin), np.abs(hi - origin))))
    t = float(hits.t[0]) if hits.hit[0] else far
    return RayPath(pixel, ("pass", "ran", "waits for", *fields, "hit t", "hit triangle"), rows,
                   origin, origin + t * direction, _boxes(tracer, passes), int(hits.triangle[0]),
                   count)


def _boxes(tracer: Tracer, passes: list[Pass]) -> np.ndarray:
    """(k, 2, 3), without the same one twice in a row."""
    accelerator = tracer.accelerator
    place = next((name for name in PLACES if name in passes[0].state), "")
    at = np.array([one.state[place][0] for one in passes
                   if place and int(one.state["phase"][0]) > 0], np.int64)
    if not len(at):
        return np.zeros((0, 2, 3))
    if place == "node" and accelerator.boxes is not None:
        boxes = np.stack(accelerator.boxes(), axis=1).astype(np.float64)
        boxes = boxes[at[(at >= 0) & (at < len(boxes))]]
    elif place == "cell" and isinstance(accelerator.structure, Grid):
        grid = accelerator.structure
        lo = grid.lo + at[((at >= 0) & (at < grid.resolution)).all(axis=1)] * grid.cell_size
        boxes = np.stack([lo, lo + grid.cell_size], axis=1)
    else:
        return np.zeros((0, 2, 3))
    if len(boxes) > 1:
        boxes = boxes[np.append(True, (boxes[1:] != boxes[:-1]).any(axis=(1, 2)))]
    return boxes
