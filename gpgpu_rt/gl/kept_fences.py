"""Kept fences: works around a use of freed memory in Mesa's llvmpipe.

The passes into a framebuffer form a scene of llvmpipe, and every scene has a fence. Each drawing
thread locks the fence, counts itself, wakes the waiting threads and unlocks the fence. But the
thread that issues draws looks only at the count (``lp_fence_signalled``), and may free the fence
of
the scene before last while a thread still has to unlock it. The thread then writes into freed
memory, which damages the heap after millions of passes. Mesa 22.3 has this fault; the same lines
are in Mesa 25.
"""
from __future__ import annotations

from collections import deque

import moderngl

# llvmpipe has at most 64 scenes at a time. Once 128 later scenes began, at least 64 of them are
# finished by all threads, so no thread uses the first fence any more.
KEPT = 128


class KeptFences:
    """Keeps the fences of the last scenes, if the renderer is llvmpipe.

    A query refers to the fence of the scene in which it last ended. So we end a query in every
    scene, and use the queries in turns.
    """

    def __init__(self, context: moderngl.Context, renderer: str) -> None:
        self._queries: deque[moderngl.Query] = deque()
        if renderer.startswith("llvmpipe"):
            # They count primitives, because they run within occlusion queries.
            self._queries.extend(context.query(primitives=True) for _ in range(KEPT))

    def keep(self) -> None:
        """Keep the fence of the current scene. Call this after all that may start a scene: a draw,
        a clear, or the start of a query."""
        if self._queries:
            with self._queries[0]:
                pass
            self._queries.rotate(-1)
