"""Logs: Dask's own, silent while workers are used: who interrupts or loses them is told by us, and
a traceback of Dask's would come after that."""
from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Iterator

SILENT = logging.CRITICAL + 1
_levels: dict[logging.Handler, int] = {}    # before anyone was within
_within = 0
_lock = threading.Lock()


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Within, what Dask prints of this process is not, as beside its local processes; handlers
    that are none of its streams go on. Whoever is in it last puts back what the first found."""
    global _within
    with _lock:
        if not _within:
            _levels.update({handler: handler.level
                            for handler in logging.getLogger("distributed").handlers
                            if isinstance(handler, logging.StreamHandler)})
            for handler in _levels:
                handler.setLevel(SILENT)
        _within += 1
    try:
        yield
    finally:
        with _lock:
            _within -= 1
            if not _within:
                for handler, level in _levels.items():
                    handler.setLevel(level)
                _levels.clear()
