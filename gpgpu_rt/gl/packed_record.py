"""Packed record: a table record whose fields are bits of integers."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import LimitError
from .record import Plane, sampler_glsl


@dataclass(frozen=True)
class PackedRecord:
    """A table record of integer texels. A texel has up to four channels. A channel holds fields.

    ``"lo:16 hi:16 | link:32"`` lists the fields of each channel from the lowest bit up. In GLSL,
    ``<name>_lo(i)`` returns the field ``lo`` of row ``i`` as a uint.
    """

    name: str
    layout: str

    @cached_property
    def fields(self) -> tuple[tuple[str, int, int, int], ...]:
        """Name, channel, lowest bit and number of bits of each field."""
        found = []
        for channel, word in enumerate(self.layout.split("|")):
            shift = 0
            for field in word.split():
                name, _, bits = field.partition(":")
                found.append((name, channel, shift, int(bits)))
                shift += int(bits)
            if shift > 32:
                raise ValueError(f"record {self.name}: channel {channel} has over 32 bits")
        return tuple(found)

    @property
    def channels(self) -> int:
        used = self.layout.count("|") + 1
        return used if used < 4 else 4 * self.texels

    @property
    def texels(self) -> int:
        return (self.layout.count("|") + 4) // 4

    def pack(self, **arrays: np.ndarray) -> np.ndarray:
        """Return texels, (n, texels, channels of a texel) uint32, from an (n,) array per field.

        Raises
        ------
        LimitError
            for a value that does not fit its bits
        """
        packed = np.zeros((len(next(iter(arrays.values()))), self.channels), np.uint32)
        for name, channel, shift, bits in self.fields:
            values = np.asarray(arrays[name]).astype(np.int64)
            if len(values) and (values.min() < 0 or values.max() >= 1 << bits):
                raise LimitError(f"{self.name}.{name} does not fit its {bits} bits; use a "
                                 "smaller scene, or leave quantise_nodes out")
            packed[:, channel] |= (values << shift).astype(np.uint32)
        return packed.reshape(len(packed), self.texels, self.channels // self.texels)

    def unpack(self, texels: np.ndarray) -> dict[str, np.ndarray]:
        """Return arrays by field name from texels, (..., texels, 4) uint32."""
        channels = texels.reshape(*texels.shape[:-2], -1).astype(np.int64)
        return {name: channels[..., channel] >> shift & (1 << bits) - 1
                for name, channel, shift, bits in self.fields}

    @property
    def planes(self) -> tuple[Plane, ...]:
        """The single plane, a texture of integers."""
        return (Plane("", 0, self.texels, self.channels // self.texels, "u4"),)

    def table_glsl(self) -> str:
        """Return a GLSL accessor per field: ``quantised_node_lo_x(i)``."""
        lines = [sampler_glsl("usampler2D", self.name)]
        for name, channel, shift, bits in self.fields:
            place = f"i * {self.texels} + {channel // 4}" if self.texels > 1 else "i"
            texel = f"TABLE_FETCH({self.name}, {place}).{'xyzw'[channel % 4]}"
            value = texel if bits == 32 else f"({texel} >> {shift}) & {(1 << bits) - 1}u"
            lines.append(f"uint {self.name}_{name}(int i) {{ return {value}; }}")
        return "\n".join(lines)
