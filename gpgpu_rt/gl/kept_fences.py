"""Kept fences: works around a use of freed memory in Mesa's llvmpipe.

llvmpipe draws in threads. The passes into a framebuffer form a scene, and every scene has a fence:
each thread locks the fence, counts itself, wakes the waiting threads and unlocks the fence. But
the thread that draws looks only at the count (``lp_fence_signalled``), and may then free the fence
of the scene before last, although a thread has not unlocked it yet. The thread then writes into
freed memory. On a busy machine, this damaged the heap once in about 10 million passes. Mesa 22.3
has this fault; the same lines are in Mesa 25.
"""
from __future__ import annotations

from collections import deque

import moderngl

# llvmpipe has at most 64 scenes at a time. Of 128 later scenes, at least 64 were finished by all
# threads, so no thread uses the first fence any more.
KEPT = 128


class KeptFences:
    """Keeps the fences of the last scenes, if the renderer is llvmpipe.

    When a query ends, it takes a reference to the fence of the current scene, and it holds the
    reference until it ends again. So we end a query in every scene, and use the queries in turns.
    """

    def __init__(self, context: moderngl.Context, renderer: str) -> None:
        self._queries: deque[moderngl.Query] = deque()
        if renderer.startswith("llvmpipe"):
            # Primitives, because these queries run within occlusion queries.
            self._queries.extend(context.query(primitives=True) for _ in range(KEPT))

    def keep(self) -> None:
        """Keep the fence of the current scene. Call this after every draw, after every clear, and
        after every start of a query, because each of them may start a scene."""
        if self._queries:
            with self._queries[0]:
                pass
            self._queries.rotate(-1)
