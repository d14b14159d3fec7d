"""Kept fences: works around a use-after-free fault in Mesa's llvmpipe.

In llvmpipe, the passes into a framebuffer form a scene, and every scene has a fence. Each drawing
thread locks the fence, increments the fence's count, wakes the waiting threads and unlocks the
fence. The thread that issues draws reads only the count (``lp_fence_signalled``). So this thread
may free the fence of an earlier scene before a drawing thread unlocks the fence. The drawing
thread then writes into freed memory. Mesa 22.3 has this fault, and Mesa 25.0 has the same code.
"""
from __future__ import annotations

from collections import deque

import moderngl

# 512 queries keep the fences of all current scenes: llvmpipe has at most 64 scenes at a time, and
# a scene has a few calls of `keep`. With so many queries, no scene uses a query twice, which would
# make llvmpipe wait for the scene.
KEPT = 512


class KeptFences:
    """Keeps the fences of the most recent scenes, if the renderer is llvmpipe.

    A query keeps a reference to the fence of the scene in which the query most recently ended. So
    `keep` ends a query in every scene, and uses the queries in turn.
    """

    def __init__(self, context: moderngl.Context, renderer: str) -> None:
        self._queries: deque[moderngl.Query] = deque()
        if renderer.startswith("llvmpipe"):
            # Count primitives: an occlusion query cannot run within an occlusion query.
            self._queries.extend(context.query(primitives=True) for _ in range(KEPT))

    def keep(self) -> None:
        """Keep the fence of the current scene. Call this after every draw, clear or start of a
        query, because each of these may start a scene."""
        if self._queries:
            with self._queries[0]:
                pass
            self._queries.rotate(-1)
