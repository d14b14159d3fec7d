"""Pictures: draws pictures of a tracer's scene, and lists the passes and textures of a picture."""
from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from PIL import Image

from ..errors import Error, OptionError
from ..gl.context import Gpu
from ..gl.textures import release, texture_bytes
from ..hits import Hits
from ..rays.batch import hits_of
from ..rays.eye_rays import EyeRays
from ..rays.records import HIT
from ..render.integrators import Integrator, find_integrator
from ..render.needs import SceneNeeds
from ..render.plan import Plan
from ..render.waves import Waves
from ..scene.camera import Camera
from ..scene.region import Region
from ..statistics import Statistics
from .session import Session

Progress = Callable[[int, int, float], None]    # samples done, samples in all, noise so far


class Pictures:
    """Draws pictures with the rays of a session, and keeps the last integrator. Methods of
    `Tracer` with the same names document the parameters."""

    def __init__(self, gpu: Gpu, statistics: Statistics) -> None:
        self.gpu, self.statistics = gpu, statistics
        self.integrator: Integrator | None = None

    def render(self, session: Session, camera: Camera | None, region: Region,
               integrator: str | None, progress: Progress | None, first_hits: str,
               options: Mapping[str, Any]) -> Image.Image:
        drawer = self._drawer(session, region, integrator, options)
        drawer.progress = progress
        if first_hits != "traced" and not drawer.region.is_whole:
            raise OptionError("the rasteriser draws whole pictures; give first_hits=traced for a "
                              "region")
        if first_hits != "traced" and not drawer.centred:
            raise OptionError(f"integrator {drawer.name} spreads eye rays over each pixel, but "
                              "the rasteriser samples only centres; give first_hits=traced")
        rays, buffers = session.buffers.of(drawer.size)
        buffers.keep(drawer.packed_sizes)
        driver = session.eye_driver(first_hits)
        began = time.perf_counter()
        waves = Waves(driver, buffers, self.statistics,
                      lambda hits: session.count(hits, self.statistics))
        try:
            pixels = waves.draw(drawer, rays, camera or session.scene.camera)
            self.gpu.check_error("rendering")
        finally:    # time interrupted pictures too
            self.statistics.trace_seconds = time.perf_counter() - began
        return Image.fromarray(pixels)

    @property
    def radiance(self) -> np.ndarray:
        """The linear radiance of the last picture of the integrator "path", (height, width, 3)
        float32."""
        found = self.integrator.radiance if self.integrator is not None else None
        if found is None:
            raise Error('there is no radiance yet; render with integrator="path"')
        return found

    def unfinished(self) -> Image.Image | None:
        """Return the unfinished picture of the integrator "path" after an interrupt, or None."""
        if self.integrator is None or self.integrator.radiance is None:
            return None
        return Image.fromarray(self.integrator.show(self.integrator.radiance.astype(np.float64)))

    def eye_hits(self, session: Session, camera: Camera | None, size: tuple[int, int],
                 first_hits: str) -> Hits:
        """Return the hits of the eye rays of ``render``, row by row from the top."""
        statistics = self.statistics
        statistics.start_call(size[0] * size[1])
        rays, buffers = session.buffers.of(size)
        driver = session.eye_driver(first_hits)
        eye = EyeRays(self.gpu, session.structure.precision)
        eye.write(rays, camera or session.scene.camera, session.scene.bounds)
        self.gpu.finish()
        began = time.perf_counter()
        side, statistics.stopped = driver.run(rays, buffers, statistics)
        self.gpu.finish()
        statistics.trace_seconds = time.perf_counter() - began
        hits = hits_of(side.fields(HIT.name))
        session.finish(hits, side, statistics)
        eye.release()
        self.gpu.check_error("tracing eye rays")
        statistics.readback_seconds = time.perf_counter() - began - statistics.trace_seconds
        return hits

    def plan(self, session: Session, region: Region, integrator: str | None,
             options: Mapping[str, Any]) -> Plan:
        """Return the plan of a ``render`` with these arguments."""
        drawer = self._drawer(session, region, integrator, options)
        rays, buffers = session.buffers.of(drawer.size)
        buffers.side(0)
        buffers.keep(drawer.packed_sizes)
        return Plan.of(drawer, {
            **{f"the method's {name}": taken
               for name, taken in session.structure.table_bytes.items()},
            "eye rays": texture_bytes(rays.textures), "state and hits": buffers.bytes()})

    def _drawer(self, session: Session, region: Region, integrator: str | None,
                options: Mapping[str, Any]) -> Integrator:
        """Return the last integrator if it fits the picture, else a new integrator."""
        kind, last = find_integrator(integrator), self.integrator
        asked = kind.asked(options, session.structure.precision)
        needs = SceneNeeds.of(session.scene, asked)
        with self.gpu:
            if last is None or type(last) is not kind or last.needs != needs:
                release(last)
                self.integrator = kind(self.gpu, session.structure.shown, needs,
                                       session.options["intersection"])
            assert self.integrator is not None
            self.statistics.start_call(region.size[0] * region.size[1])
            self.integrator.start(region, options)
        return self.integrator

    def follow(self, session: Session) -> None:
        """Make the integrator shade the surfaces of this session from now on."""
        if self.integrator is not None:
            self.integrator.take(session.structure.shown)

    def bytes(self) -> int:
        return sum(self.integrator.bytes().values()) if self.integrator is not None else 0

    def release(self) -> None:
        """Free the integrator, and ``radiance`` with it."""
        release(self.integrator)
        self.integrator = None
