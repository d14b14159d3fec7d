"""Occlusion query: counts the fragments that pass the depth test."""
from __future__ import annotations

import moderngl

from .kept_fences import KeptFences


class OcclusionQuery:
    """An occlusion query for one use: draw in a ``with`` block, then read ``samples``.

    OpenGL's query objects are reused, because moderngl cannot delete them, and millions of passes
    would fill the memory.

    Parameters
    ----------
    free : the context's unused OpenGL queries; reading the result returns the query to this list
    """

    def __init__(self, context: moderngl.Context, free: list[moderngl.Query],
                 fences: KeptFences) -> None:
        self._query: moderngl.Query | None = (
            free.pop() if free else context.query(samples=True))
        self._free, self._fences, self._samples = free, fences, 0

    def __enter__(self) -> OcclusionQuery:
        assert self._query is not None      # an object can be used only once
        self._query.__enter__()
        self._fences.keep()
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
