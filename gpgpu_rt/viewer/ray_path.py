"""A ray's path: the states of a ray after each pass, as table rows and as boxes in space."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..inspect.places import Places
from ..inspect.time_travel import Fields, Pass, phase_names, travel
from ..scene.camera import Camera
from ..text_format import counted
from ..tracer import Tracer
from .journey import hit_words, word_of

MOST_ROWS = 20_000
# The corner numbers of a box's edges. Bit k of a number chooses the upper coordinate along axis k.
_EDGES = np.array([(a, a | 1 << axis) for a in range(8) for axis in range(3)
                   if not a >> axis & 1])


@dataclass
class Place:
    """A node or a cell that a ray visits.

    Attributes
    ----------
    title : the name, such as "node 12"
    box : (2, 3) lower and upper corner
    record : (name, text) of each field of the place's records, decoded from the textures;
        (name, "") begins a record
    """

    title: str
    box: np.ndarray
    record: list[tuple[str, str]]


@dataclass
class RayPath:
    """The path of the ray through a pixel.

    Attributes
    ----------
    pixel : (x, y) of the picture, row 0 at the top
    size : (width, height) of the picture in pixels
    columns, rows : a table with a row for each counted pass (see ``count``): the pass, its
        kernel, the next kernel, the fields of the ray's state, and the nearest hit so far
    origin : (3,) start of the ray
    end : (3,) the ray's hit, or a point outside the scene if the ray misses
    boxes : (k, 2, 3) lower and upper corners of the visited nodes or cells, in order; may be empty
    places : the node or cell of each row, or None
    hit : the triangle, or -1
    count : number of counted passes: the first pass, and all passes that changed the ray. At most
        MOST_ROWS passes have rows
    row : the index of the chosen row, or None
    """

    pixel: tuple[int, int]
    size: tuple[int, int]
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    origin: np.ndarray
    end: np.ndarray
    boxes: np.ndarray
    places: list[Place | None]
    hit: int
    count: int
    row: int | None = None

    @property
    def place(self) -> Place | None:
        return None if self.row is None else self.places[self.row]

    def go(self, by: int) -> None:
        """Choose the row ``by`` rows below the chosen row; if none is chosen, the first row."""
        at = 0 if self.row is None else self.row + by
        self.row = min(max(at, 0), len(self.rows) - 1)

    def title(self) -> str:
        rows = counted(self.count, "pass")
        if self.count > len(self.rows):
            rows = f"the first {len(self.rows):,} of {rows}"
        (x, y), (width, height) = self.pixel, self.size
        return (f"The ray of pixel {x}, {y} of {width} x {height}: {rows}, "
                + (f"hits triangle {self.hit}" if self.hit >= 0 else "hits nothing"))

    def edges(self) -> np.ndarray:
        return edges_of(self.boxes)


def edges_of(boxes: np.ndarray) -> np.ndarray:
    """Return the edges, (k, 12, 2, 3), of boxes, (k, 2, 3)."""
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1                # (8, 3)
    corners = np.where(bits[None] == 1, boxes[:, 1:], boxes[:, :1])
    return corners[:, _EDGES]


def follow(tracer: Tracer, camera: Camera, size: tuple[int, int],
           pixel: tuple[int, int]) -> RayPath:
    """Trace only the ray through a pixel, and record the ray's state after each pass.

    Parameters
    ----------
    tracer : a tracer under ``step`` with one step per pass, or under ``kernels``
    camera : the camera of the picture
    size : (width, height) of the picture in pixels
    pixel : (x, y), row 0 at the top
    """
    x, y = pixel
    origins, directions = (part[y:y + 1, x:x + 1] for part in camera.rays(size))
    names = phase_names(tracer)
    passes: list[Pass] = []
    count = 0

    def look(one: Pass) -> None:    # omit passes that did not change the ray
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
    places = Places(tracer, passes[0].state)
    at = places.numbers({name: np.concatenate([one.state[name] for one in passes])
                         for name in passes[0].state})
    origin, direction = origins[0, 0].astype(np.float64), directions[0, 0].astype(np.float64)
    lo, hi = tracer.scene.bounds
    far = float(np.linalg.norm(np.maximum(np.abs(lo - origin), np.abs(hi - origin))))
    t = float(hits.t[0]) if hits.hit[0] else far
    columns = ("pass", "ran", "waits for", *fields, "hit t", "hit triangle")
    return RayPath(pixel, size, columns, rows, origin, origin + t * direction,
                   _boxes(places, at[at >= 0]), _places(places, at, passes),
                   int(hits.triangle[0]), count)


def _boxes(places: Places, at: np.ndarray) -> np.ndarray:
    """Return the boxes of places, (k, 2, 3), without consecutive repeats."""
    if not len(at):
        return np.zeros((0, 2, 3))
    boxes = places.boxes(at)
    return boxes[np.append(True, (boxes[1:] != boxes[:-1]).any(axis=(1, 2)))]


def _places(places: Places, at: np.ndarray, passes: list[Pass]) -> list[Place | None]:
    known: dict[int, Place] = {}
    for number, one in zip(at.tolist(), passes):
        if number >= 0 and number not in known:
            known[number] = Place(_title(places.kind, one.state),
                                  places.boxes(np.array([number]))[0],
                                  _record_words(places, number))
    return [known.get(number) for number in at.tolist()]


def _title(kind: str, state: Fields) -> str:
    return f"{kind} {word_of(state[kind][0])}"


def _record_words(places: Places, number: int) -> list[tuple[str, str]]:
    words = []
    for record, fields in places.records(number).items():
        words += [(record, ""), *((name, word_of(value)) for name, value in fields.items())]
    return words
