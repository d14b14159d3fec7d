"""Occlusion query: counts the fragments that pass the depth test, in one or more draws."""
from __future__ import annotations

from collections import deque

import moderngl

# A query of OpenGL rests for this number of other queries before it is used again. When a query
# begins again, Mesa frees the fence of its last use. When queries did not rest, two of three runs
# of 3.3 million passes on a loaded machine ended with a corrupted heap. The cause is not proven;
# a thread of Mesa may still use the fence for a moment after the result is known.
REST = 256


class OcclusionQuery:
    """An occlusion query for one use: draw in a ``with`` block, then read ``samples``.

    moderngl cannot delete a query of OpenGL. A schedule with millions of passes would therefore
    fill the memory, so queries of OpenGL are used again, the longest unused query first.

    Parameters
    ----------
    free : the context's queries that no `OcclusionQuery` uses. The query returns to these
        queries when its result is read
    """

    def __init__(self, context: moderngl.Context, free: deque[moderngl.Query]) -> None:
        self._query: moderngl.Query | None = (
            free.popleft() if len(free) > REST else context.query(samples=True))
        self._free, self._samples = free, 0

    def __enter__(self) -> OcclusionQuery:
        assert self._query is not None      # an `OcclusionQuery` can be used once
        self._query.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        assert self._query is not None
        self._query.__exit__(*exception)

    @property
    def samples(self) -> int:
        """The number of fragments that passed the depth test."""
        if self._query is not None:
            self._samples = int(self._query.samples)
            self._free.append(self._query)
            self._query = None
        return self._samples
