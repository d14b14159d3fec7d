"""Logs: silence Dask's log while workers are in use.

When workers are interrupted or lost, the user sees this program's message, not Dask's traceback.
"""
from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Iterator

SILENT = logging.CRITICAL + 1
_levels: dict[logging.Handler, int] = {}    # each handler's level outside of all contexts
_within = 0
_lock = threading.Lock()


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Return a context in which Dask prints no log of this process.

    Only handlers that write to a stream are silenced. If contexts overlap, the handlers stay
    silent until the last context ends.
    """
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
