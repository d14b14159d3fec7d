"""Tracers of one scene: what is looked at needs several, and some of them again and again."""
from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from ..gl.context import Gpu
from ..methods import find_method
from ..render.integrators import DEFAULT
from ..scene.scene import Scene
from ..tracer import Tracer

KEPT = 3
PROOF = (8, 8)      # pixels: small, but every program runs


class Tracers:
    """The last few tracers of a scene, made when they are asked for.

    A tracer that comes out of here has drawn a picture: whatever is wrong with a method's programs
    was found before anything else was given up for it.

    Attributes
    ----------
    pinned : one that is kept however long ago it was asked for: what pictures are drawn with
    made : how many were made so far
    """

    def __init__(self, gpu: Gpu, scene: Scene) -> None:
        self.gpu, self.scene = gpu, scene
        self.pinned: Tracer | None = None
        self.made = 0
        self._tracers: OrderedDict[str, Tracer] = OrderedDict()

    def get(self, method: str, options: Mapping[str, Any], integrator: str = DEFAULT,
            light: Mapping[str, Any] = {}) -> Tracer:
        """The tracer of a method under these options, proved with an integrator.

        Raises
        ------
        Error, ValueError, MemoryError
            whatever making it raises, or drawing with it
        """
        key = repr((method, sorted(options.items(), key=str), integrator,
                    sorted(light.items(), key=str)))
        if key not in self._tracers:
            tracer = Tracer(self.scene, method, **{**options, "context": self.gpu})
            try:
                proof = {**light, "samples": 1} if "samples" in light or integrator == "path" \
                    else light
                tracer.render(size=PROOF, integrator=integrator, **proof)
            except BaseException:
                tracer.release()
                raise
            self._tracers[key] = tracer
            self.made += 1
        self._tracers.move_to_end(key)
        old = [name for name, one in self._tracers.items()
               if one is not self.pinned and name != key]
        for name in old[:max(0, len(self._tracers) - KEPT)]:
            self._tracers.pop(name).release()
        return self._tracers[key]

    def in_passes(self, method: str, options: Mapping[str, Any], single: bool = False) -> Tracer:
        """One under a schedule whose passes can be looked at; ``single``: one step a pass."""
        return self.get(method, find_method(method).in_passes(options, single))

    def release(self) -> None:
        """Free all of them."""
        for tracer in self._tracers.values():
            tracer.release()
        self._tracers.clear()
