"""Column: makes a field of a table slice by slice, to save memory."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Column:
    """A replacement for an array of ``count`` rows. ``make`` returns the rows of a slice."""

    count: int
    make: Callable[[slice], np.ndarray]

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self.make(rows)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.make(slice(None)), dtype)
