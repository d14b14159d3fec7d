"""Places: finds the node or cell of each ray state, and reads this place's box and records."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..gl.packed_record import PackedRecord
from ..gl.record import Record
from ..gl.textures import read_texels
from ..methods.grid.cells import Grid
from ..tracer import Tracer
from ..traversal.triangle_table import REFERENCE, TRIANGLE

Decoded = dict[str, dict[str, np.ndarray]]


class Places:
    """The places of a tracer's structure: a tree's nodes or a grid's cells.

    Parameters
    ----------
    tracer : a tracer with the structure
    state : fields of rays' states; ``node`` or ``cell`` is a ray's place

    Attributes
    ----------
    kind : "node" or "cell"; "" if the structure has no boxes or the states have no place
    count : number of places
    """

    def __init__(self, tracer: Tracer, state: Mapping[str, np.ndarray]) -> None:
        self._tracer, accelerator = tracer, tracer.accelerator
        self._boxes, self._grid = np.zeros((0, 2, 3)), accelerator.structure
        self.kind = ""
        if "node" in state and accelerator.boxes is not None:
            self._boxes = np.stack(accelerator.boxes(), axis=1).astype(np.float64)
            self.kind, self.count = "node", len(self._boxes)
        elif "cell" in state and isinstance(self._grid, Grid):
            self.kind, self.count = "cell", int(np.prod(self._grid.resolution))
            # In the era form with fp24, each slice of cells begins in a new row of texels.
            self._step = int(accelerator.uniforms["slice_step"])
        else:
            self.count = 0

    def numbers(self, state: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return each ray's place, (n,) int64; -1 for no place."""
        phase = state["phase"]
        if not self.kind:
            return np.full(len(phase), -1)
        at = np.asarray(state[self.kind], np.int64)
        if self.kind == "cell":
            inside = ((at >= 0) & (at < self._grid.resolution)).all(axis=1)
            at = at @ np.cumprod([1, *self._grid.resolution[:2]])
        else:
            inside = (at >= 0) & (at < self.count)
        return np.where(inside & (phase > 0), at, -1)

    def boxes(self, numbers: np.ndarray) -> np.ndarray:
        """Return the lower and upper corners of k places, (k, 2, 3) float64."""
        if self.kind != "cell":
            return self._boxes[numbers]
        grid = self._grid
        at = np.stack(np.unravel_index(numbers, grid.resolution, order="F"), axis=-1)
        lo = grid.lo + at * grid.cell_size
        return np.stack([lo, lo + grid.cell_size], axis=1).astype(np.float64)

    def records(self, number: int) -> Decoded:
        """Return a place's records, decoded from the textures: record -> field -> value.
        Skip tables without a record per place, and tables of triangles."""
        tracer, session = self._tracer, self._tracer.session
        count = self.count
        if self.kind == "cell":
            width, height, depth = map(int, self._grid.resolution)
            number = number % (width * height) + number // (width * height) * self._step
            count = self._step * depth
        found: Decoded = {}
        for record in tracer.method.tables_for(tracer.options):
            arrays = tracer.accelerator.tables[record.name]
            if (record.name not in (TRIANGLE.name, REFERENCE.name)
                    and len(next(iter(arrays.values()))) == count):
                with session.gpu:
                    found[record.name] = _decoded(session.structure.precision.layout(record),
                                                  session.tables[record.name], number)
        return found


def _decoded(record: Record | PackedRecord, textures: Mapping, number: int
             ) -> dict[str, np.ndarray]:
    kind = np.uint32 if isinstance(record, PackedRecord) else np.float32
    texels = np.zeros((record.texels, 4), kind)
    for plane in record.planes:
        texture = textures[f"{record.name}{plane.suffix}_table"]
        texels[plane.first:plane.first + plane.texels, :plane.components] = read_texels(
            texture, number * plane.texels, plane.texels)
    return record.unpack(texels)
