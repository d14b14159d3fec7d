"""Shared arrays: numpy arrays in one block of memory that several processes see."""
from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

import numpy as np

from ..errors import LimitError

ALIGNMENT = 64      # bytes: a cache line


@dataclass(frozen=True)
class SharedArrays:
    """What another process needs to find the arrays: small, and can be pickled.

    block : the block's name
    places : array name -> dtype, shape and first byte
    """

    block: str
    places: Mapping[str, tuple[str, tuple[int, ...], int]]

    @contextlib.contextmanager
    def open(self) -> Iterator[dict[str, np.ndarray]]:
        """The arrays, in another process; views, of no use behind the ``with``."""
        memory = SharedMemory(self.block)
        try:
            yield {name: np.ndarray(shape, dtype, memory.buf, first)
                   for name, (dtype, shape, first) in self.places.items()}
        finally:
            # Views that an exception's traceback still holds keep the mapping; it ends with the
            # process, and the block itself is its maker's to remove.
            with contextlib.suppress(BufferError):
                memory.close()


@contextlib.contextmanager
def shared_arrays(**arrays: np.ndarray) -> Iterator[SharedArrays]:
    """Copies of the arrays in shared memory, which is freed behind the ``with``, whatever happens.

    Raises
    ------
    LimitError
        where there is no room for them.
    """
    places, size = {}, 0
    for name, array in arrays.items():
        places[name] = (array.dtype.str, array.shape, size)
        size += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
    try:
        memory = SharedMemory(create=True, size=max(size, 1))
    except OSError as failure:
        raise LimitError(f"no {size:,} bytes of shared memory to be had ({failure.strerror}); "
                         "take workers=1") from failure
    try:
        for name, (dtype, shape, first) in places.items():
            np.ndarray(shape, dtype, memory.buf, first)[...] = arrays[name]
        yield SharedArrays(memory.name, places)
    finally:
        memory.close()
        memory.unlink()
