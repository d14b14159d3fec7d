"""Scene tables: writes the tables of an accelerator into textures, if the tables changed."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.record import SMALL_INTEGER
from ..gl.textures import check_table, largest_integer, release, table_textures, texture_bytes
from ..traversal.accelerator import Accelerator
from ..traversal.method import Tables


class SceneTables(dict[str, dict[str, moderngl.Texture]]):
    """The textures of tables: record name -> sampler name -> texture.

    Attributes
    ----------
    written : record name -> the accelerator's arrays that the textures hold
    integers : record name -> the largest integer that the textures hold
    """

    def __init__(self, gpu: Gpu, precision: Precision) -> None:
        super().__init__()
        self.gpu, self.precision = gpu, precision
        self.written: dict[str, Mapping[str, object]] = {}
        self.integers: dict[str, int] = {}

    def write(self, records: Tables, accelerator: Accelerator) -> None:
        """Write an accelerator's tables into textures, and run the passes that complete them.

        Textures of the same size are reused. A table is not written again if its arrays are the
        same object as before.
        """
        for record in records:
            arrays = accelerator.tables[record.name]
            if self.written.get(record.name) is not arrays:
                self[record.name] = table_textures(
                    self.gpu, self.precision.layout(record), arrays, self.precision,
                    self.get(record.name))
                self.written[record.name] = arrays
                self.integers[record.name] = largest_integer(record, arrays)
        if accelerator.finisher is not None:
            accelerator.finisher.run(self.gpu, self.samplers())
            self.gpu.finish()

    @property
    def small_integers(self) -> bool:
        """Whether every integer is small enough for SMALL_INTEGERS (core/fetch.glsl)."""
        return max(self.integers.values(), default=0) <= SMALL_INTEGER

    def check(self, records: Tables, accelerator: Accelerator) -> None:
        """Raise LimitError if a table exceeds the limits of textures."""
        for record in records:
            check_table(self.gpu, self.precision.layout(record), accelerator.tables[record.name])

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {name: texture for table in self.values() for name, texture in table.items()}

    def bytes(self) -> dict[str, int]:
        """Return record name -> bytes of its textures."""
        return {name: texture_bytes(table.values()) for name, table in self.items()}

    def keep(self, records: Tables) -> None:
        for name in self.keys() - {record.name for record in records}:
            del self.written[name], self.integers[name]
            release(self.pop(name))
