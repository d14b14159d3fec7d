"""Number formats of the hardware of 2002-2007: rounds numbers as that hardware did.

``storage`` is the format of the geometric channels of ray, state, hit and node textures.
``arithmetic`` is the format to which each result of a kernel is rounded. Indices stay exact.
``glsl/core/precision.glsl`` rounds to the same bits.

fp16 is s10e5 with denormals, as in OpenEXR and NV30. fp24 is ATI's s16e7 of R300 and R420, without
denormals, emulated in float32. The option ``rounding`` exists because no source states for certain
how this hardware rounded. A finite value above the largest number becomes the largest number, so
rounding never makes a finite ``t_max`` infinite.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from .packed_record import PackedRecord
from .record import Record

PRECISIONS = ("fp32", "fp24", "fp16")
ROUNDINGS = ("nearest", "chop", "up")


@dataclass(frozen=True)
class Format:
    """A floating point format whose numbers are float32 numbers, too.

    Attributes
    ----------
    mantissa_bits : explicit bits of the mantissa
    smallest : the smallest normal number
    quantum : distance between neighbouring numbers below ``smallest``; equal to ``smallest`` if
        there are no denormals
    largest : the largest finite number
    """

    mantissa_bits: int
    smallest: float
    quantum: float
    largest: float

    @property
    def unit(self) -> float:
        """The unit roundoff of rounding to nearest."""
        return 2.0 ** -(self.mantissa_bits + 1)

    def round(self, values: np.ndarray, rounding: str = "nearest") -> np.ndarray:
        """Return float32 values rounded to this format, as float32: to nearest with ties to even
        (``nearest``), towards zero (``chop``), or towards plus infinity (``up``)."""
        x = np.ascontiguousarray(values, np.float32)
        dropped = np.uint32(23 - self.mantissa_bits)
        if not dropped:
            return x
        below = np.uint32((1 << int(dropped)) - 1)
        bits = x.view(np.uint32)
        with np.errstate(over="ignore", invalid="ignore"):
            multiple = x / np.float32(self.quantum)
            if rounding == "nearest":
                bits = bits + (below >> np.uint32(1)) + ((bits >> dropped) & np.uint32(1))
                multiple = np.rint(multiple)
            elif rounding == "up":
                bits = bits + np.where(x > 0, below, np.uint32(0))
                multiple = np.ceil(multiple)
            else:
                multiple = np.trunc(multiple)
            normal = (bits & ~below).view(np.float32)
            rounded = np.where(np.abs(x) < np.float32(self.smallest),
                               multiple * np.float32(self.quantum), normal)
            rounded = np.clip(rounded, np.float32(-self.largest), np.float32(self.largest))
        return np.where(np.isfinite(x), rounded, x).astype(np.float32)


FORMATS = {
    "fp32": Format(23, 2.0 ** -126, 2.0 ** -126, float(np.finfo(np.float32).max)),
    "fp24": Format(16, 2.0 ** -62, 2.0 ** -62, (2 - 2.0 ** -16) * 2.0 ** 63),
    "fp16": Format(10, 2.0 ** -14, 2.0 ** -24, 65504.0),
}


@dataclass(frozen=True)
class Precision:
    """A tracer's options ``storage``, ``arithmetic`` and ``rounding``."""

    storage: str = "fp32"
    arithmetic: str = "fp32"
    rounding: str = "nearest"

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Precision:
        return cls(options["storage"], options["arithmetic"], options["rounding"])

    @overload
    def layout(self, record: Record) -> Record: ...

    @overload
    def layout(self, record: PackedRecord) -> PackedRecord: ...

    def layout(self, record: Record | PackedRecord) -> Record | PackedRecord:
        return record if isinstance(record, PackedRecord) else record.stored(self.storage)

    def stored(self, values: np.ndarray) -> np.ndarray:
        """Return geometric values rounded for textures, as float32."""
        return FORMATS[self.storage].round(values, self.rounding)

    def stored_fields(self, record: Record | PackedRecord,
                      arrays: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """Return a table's fields, with rounded geometric fields."""
        if isinstance(record, PackedRecord):
            return arrays
        integer = {field.name for field in record.fields if field.is_integer}
        return {name: values if name in integer else self.stored(values)
                for name, values in arrays.items()}

    def defines(self) -> dict[str, object]:
        """Return the defines for ``core/precision.glsl``."""
        return {**_format_defines("STORAGE", self.storage),
                **_format_defines("ARITHMETIC", self.arithmetic),
                "ROUNDING_" + self.rounding.upper(): True}


def _format_defines(prefix: str, name: str) -> dict[str, object]:
    """Return a format's defines; none for fp32, whose programs do not round."""
    if name == "fp32":
        return {}
    chosen = FORMATS[name]
    constants = (chosen.smallest, chosen.quantum, chosen.largest)
    arguments = ", ".join([f"{23 - chosen.mantissa_bits}u", *(f"{c:.9e}" for c in constants)])
    return {prefix + "_FORMAT": arguments, prefix + "_UNIT": f"{chosen.unit:.9e}"}
