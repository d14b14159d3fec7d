"""Aside: cells of which nothing is timed, measured by workers while this process measures others.

What is timed has the machine to itself all the same: workers stand still meanwhile.
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

WORTH = 8     # cells or pages: for fewer, starting processes takes longer than it saves


def worth_workers(parts: int) -> bool:
    """Whether so many parts are done sooner by several processes of this machine."""
    return parts >= WORTH and cores() > 1


class Aside:
    """Cells that workers of this machine take, one by one, and so may who has nothing else to do.

    Parameters
    ----------
    cells : in the order in which they are begun
    measured : what measures one
    """

    def __init__(self, cells: list[Cell], workers: Workers,
                 measured: Callable[[Cell], Result]) -> None:
        self._waiting = deque(cells)
        self._workers, self._measured = workers, measured
        # What came in; of a worker that is through, why it stopped, or None where nothing is left.
        self._found: queue.SimpleQueue[tuple[Cell, Result] | BaseException | None]
        self._found = queue.SimpleQueue()
        self._busy = len(workers)
        for _ in range(self._busy):
            threading.Thread(target=self._keep_busy, daemon=True).start()

    def take(self) -> Cell | None:
        """One that nobody has begun, if there is one: the caller's from now on."""
        with contextlib.suppress(IndexError):
            return self._waiting.popleft()
        return None

    def done(self, wait: bool = False) -> Iterator[tuple[Cell, Result]]:
        """Those that came in since it was asked last; or, if it shall ``wait``, to the end.

        Raises
        ------
        Error
            where workers died again and again; and whatever measuring raises
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
        """Give one worker a cell after another."""
        end = None
        try:
            while (cell := self.take()) is not None:
                [(_, result)] = self._workers.map(self._measured, [(cell,)])
                self._found.put((cell, result))
        except BaseException as failure:     # for who waits to raise
            end = failure
        self._found.put(end)
