"""Shared arrays: numpy arrays in a block of memory that several processes share."""
from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

import numpy as np

from ..errors import LimitError

ALIGNMENT = 64      # bytes; the size of a cache line


@dataclass(frozen=True)
class SharedArrays:
    """A small handle to shared arrays; it can be pickled and sent to another process.

    block : the name of the memory block
    places : dtype, shape and offset in bytes of each array, by name
    """

    block: str
    places: Mapping[str, tuple[str, tuple[int, ...], int]]

    @contextlib.contextmanager
    def open(self) -> Iterator[dict[str, np.ndarray]]:
        """Yield the arrays in another process, as views that are valid only in this context."""
        memory = SharedMemory(self.block)
        try:
            yield {name: np.ndarray(shape, dtype, memory.buf, first)
                   for name, (dtype, shape, first) in self.places.items()}
        finally:
            # Closing fails while the traceback of an exception still holds views. The mapping then
            # stays open until the process ends. The process that made the block removes the block.
            with contextlib.suppress(BufferError):
                memory.close()


@contextlib.contextmanager
def shared_arrays(**arrays: np.ndarray) -> Iterator[SharedArrays]:
    """Copy the arrays into shared memory and yield a handle. The end of the context frees the
    memory.

    Raises
    ------
    LimitError
        there is not enough shared memory
    """
    places, size = {}, 0
    for name, array in arrays.items():
        places[name] = (array.dtype.str, array.shape, size)
        size += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
    try:
        memory = SharedMemory(create=True, size=max(size, 1))
    except OSError as failure:
        raise LimitError(f"cannot allocate {size:,} bytes of shared memory ({failure.strerror}); "
                         "use workers=1") from failure
    try:
        for name, (dtype, shape, first) in places.items():
            np.ndarray(shape, dtype, memory.buf, first)[...] = arrays[name]
        yield SharedArrays(memory.name, places)
    finally:
        memory.close()
        memory.unlink()
