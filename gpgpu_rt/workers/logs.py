"""Logs: Dask's own, silent while workers are used: who interrupts or loses them is told by us, and
a traceback of Dask's would come after that."""
from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator

SILENT = logging.CRITICAL + 1


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Within, what Dask prints of this process is not, as beside its local processes; handlers
    that are none of its streams go on."""
    levels = {handler: handler.level for handler in logging.getLogger("distributed").handlers
              if isinstance(handler, logging.StreamHandler)}
    for handler in levels:
        handler.setLevel(SILENT)
    try:
        yield
    finally:
        for handler, level in levels.items():
            handler.setLevel(level)
