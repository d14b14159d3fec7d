"""A cache of the tracers of one scene."""
from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from ..gl.context import Gpu
from ..methods import find_method
from ..render.integrators import DEFAULT
from ..scene.scene import Scene
from ..tracer import Tracer

KEPT = 3            # tracers in the cache
PROOF = (8, 8)      # size of the test picture in pixels; this suffices to run every program


class Tracers:
    """The last few tracers of a scene.

    A new tracer draws a test picture. An error in its programs thus appears while the viewer still
    has the previous tracer.

    Attributes
    ----------
    pinned : the tracer of the viewer's pictures, which always stays in the cache
    made : number of tracers made so far
    """

    def __init__(self, gpu: Gpu, scene: Scene) -> None:
        self.gpu, self.scene = gpu, scene
        self.pinned: Tracer | None = None
        self.made = 0
        self._tracers: OrderedDict[str, Tracer] = OrderedDict()

    def get(self, method: str, options: Mapping[str, Any], integrator: str = DEFAULT,
            light: Mapping[str, Any] = {}) -> Tracer:
        """Return a method's tracer with these options. Test a new tracer with the integrator.

        Raises
        ------
        Error, ValueError, MemoryError
            if the tracer cannot be made, or cannot draw the test picture
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
        """Return a tracer with many passes, if a schedule of the method has them. With ``single``,
        each pass runs one step."""
        return self.get(method, find_method(method).in_passes(options, single))

    def release(self) -> None:
        for tracer in self._tracers.values():
            tracer.release()
        self._tracers.clear()
