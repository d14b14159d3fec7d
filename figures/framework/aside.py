"""Aside: worker processes measure untimed cells while this process measures other cells.

A cell is one measurement that a figure needs. The workers pause while a timed cell is measured, so
the timed cell has the machine to itself.
"""
from __future__ import annotations

import contextlib
import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

from gpgpu_rt.threads import cores
from gpgpu_rt.workers import Workers

from .cell import Cell

Result = dict[str, Any]

# For fewer cells or pages, starting worker processes costs more time than it saves.
WORTH = 8


def worth_workers(parts: int) -> bool:
    """Whether several processes finish ``parts`` cells or pages sooner than this process alone."""
    return parts >= WORTH and cores() > 1


class Aside:
    """Cells that worker processes measure. The caller may also ``take`` cells and measure them.

    Parameters
    ----------
    cells : the cells, in the order in which they are begun
    workers : the processes that measure
    measured : the function that measures a cell
    """

    def __init__(self, cells: list[Cell], workers: Workers,
                 measured: Callable[[Cell], Result]) -> None:
        self._waiting = deque(cells)
        self._workers, self._measured = workers, measured
        # Results as they arrive. A thread that ends adds the exception that ended it, or None
        # if no cell was left.
        self._found: queue.SimpleQueue[tuple[Cell, Result] | BaseException | None]
        self._found = queue.SimpleQueue()
        self._busy = len(workers)
        for _ in range(self._busy):
            threading.Thread(target=self._keep_busy, daemon=True).start()

    def take(self) -> Cell | None:
        """Return the next cell, for the caller to measure, or None if all cells are begun."""
        with contextlib.suppress(IndexError):
            return self._waiting.popleft()
        return None

    def done(self, wait: bool = False) -> Iterator[tuple[Cell, Result]]:
        """Yield the results that arrived since the last call.

        With ``wait``, wait for the workers and yield all remaining results.

        Raises
        ------
        Error
            if workers died repeatedly; other errors of measurements are raised too
        """
        while self._busy and (wait or not self._found.empty()):
            found = self._found.get()
            if isinstance(found, BaseException):
                raise found
            if found is None:
                self._busy -= 1
            else:
                yield found

    def _keep_busy(self) -> None:
        end = None
        try:
            while (cell := self.take()) is not None:
                [(_, result)] = self._workers.map(self._measured, [(cell,)])
                self._found.put((cell, result))
        except BaseException as failure:     # `done` raises it
            end = failure
        self._found.put(end)
