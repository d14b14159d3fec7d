"""Aside: untimed cells, which worker processes measure while this process measures others.

While a cell is timed, the workers pause, so the timed cell has the machine to itself.
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

WORTH = 8     # with fewer cells or pages, starting processes costs more time than it saves


def worth_workers(parts: int) -> bool:
    """Whether several processes of this machine finish ``parts`` parts sooner than one process."""
    return parts >= WORTH and cores() > 1


class Aside:
    """Cells that worker processes measure, one cell at a time each.

    A caller that is free may measure cells as well: ``take`` hands it the next cell.

    Parameters
    ----------
    cells : in the order in which they are begun
    workers : the processes that measure
    measured : the function that measures a cell
    """

    def __init__(self, cells: list[Cell], workers: Workers,
                 measured: Callable[[Cell], Result]) -> None:
        self._waiting = deque(cells)
        self._workers, self._measured = workers, measured
        # Results as they arrive. A worker that stops adds the exception that stopped it, or None
        # if no cell is left.
        self._found: queue.SimpleQueue[tuple[Cell, Result] | BaseException | None]
        self._found = queue.SimpleQueue()
        self._busy = len(workers)
        for _ in range(self._busy):
            threading.Thread(target=self._keep_busy, daemon=True).start()

    def take(self) -> Cell | None:
        """The next cell that nobody has begun, which the caller then measures; None at the end."""
        with contextlib.suppress(IndexError):
            return self._waiting.popleft()
        return None

    def done(self, wait: bool = False) -> Iterator[tuple[Cell, Result]]:
        """Yield the results that arrived since the last call; with ``wait``, all that are left.

        Raises
        ------
        Error
            if workers died again and again; any other error of measuring is raised too
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
        """Give a worker one cell after another, until no cell is left."""
        end = None
        try:
            while (cell := self.take()) is not None:
                [(_, result)] = self._workers.map(self._measured, [(cell,)])
                self._found.put((cell, result))
        except BaseException as failure:     # `done` raises it
            end = failure
        self._found.put(end)
