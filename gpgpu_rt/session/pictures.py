"""Pictures: what a tracer draws of its scene, and what it plans to."""
from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from PIL import Image

from ..errors import Error, OptionError, memory_limited
from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.textures import release, texture_bytes
from ..hits import Hits
from ..methods import Accelerator
from ..methods.choices import COHERENT
from ..rays.batch import RayBatch, hits_of
from ..rays.eye_rays import EyeRays
from ..rays.records import HIT
from ..rays.textures import RayTextures, StateBuffers
from ..render.integrators import Integrator, find_integrator
from ..render.needs import SceneNeeds
from ..render.path import shown
from ..render.plan import Plan
from ..render.waves import Waves
from ..scene.camera import Camera, check_camera, image_size
from ..scene.region import Region
from ..scene.scene import Scene
from ..statistics import Statistics
from ..traversal.driver import Driver
from ..traversal.stages.eye_drivers import EyeDrivers
from .builder import Builder


class Pictures:
    """The part of a ``Tracer`` that renders; what it is given here is the tracer's own."""

    gpu: Gpu
    scene: Scene
    options: dict[str, Any]
    precision: Precision
    statistics: Statistics
    accelerator: Accelerator
    _traversal: Driver
    _triangles: np.ndarray
    _integrator: Integrator | None
    _eye_drivers: EyeDrivers
    _taking: Callable[[str | RayBatch], AbstractContextManager[None]]
    _room: Callable[[tuple[int, int]], tuple[RayTextures, StateBuffers]]
    _shown: Callable[[], Scene]
    _builder: Builder
    _count: Callable[..., Any]
    _finish: Callable[..., Hits]
    _logged: Callable[[], AbstractContextManager[None]]
    _add_texture_bytes: Callable[[], None]

    @memory_limited
    def render(self, camera: Camera | None = None, size: tuple[int, int] = (512, 512),
               integrator: str | None = None,
               progress: Callable[[int, int, float], None] | None = None,
               first_hits: str = "traced",
               region: tuple[int, int, int, int] | None = None,
               **options: Any) -> Image.Image:
        """A picture of the scene, all its rays traced by this tracer's method.

        Parameters
        ----------
        camera : Camera, or None for the scene's own
        size : (width, height) pixels
        integrator : "direct": light and shadows; "whitted" (default): and mirrors and glass;
            "path": and light that bounces. ``radiance`` then holds what was found
        first_hits : "traced"; "rasterised": the same ones to the bit, from the rasteriser where
            they can be proved; or "verified": from the rasteriser where they are hits at all,
            though a few pixels may lack one that comes before. ``statistics.first_hits`` says how
            many were traced after all
        progress : is told samples done, samples of all, and the noise so far, by "path"
        region : (x, y, width, height) pixels of the picture, from the top left: what is drawn of
            it, the same to the bit as in the whole; None for all. The noise that "path" is asked
            to stop at is then the region's
        options : the integrator's, as ``integrators.INTEGRATORS[name].options`` lists them

        Raises
        ------
        OptionError
            a camera that is none, a size, an integrator or an option that there is not, or a
            region outside the picture
        LimitError
            a picture too large for this renderer
        KeyboardInterrupt
            Ctrl-C; what "path" has summed up by then is a picture that ``unfinished`` gives
        """
        check_camera(camera)
        with self._taking(find_integrator(integrator).rays):
            drawer = self._drawer(Region.of(size, region), integrator, options)
            drawer.progress = progress
            if first_hits != "traced" and not drawer.region.is_whole:
                raise OptionError("the rasteriser draws whole pictures; take first_hits=traced "
                                  "for a region")
            if first_hits != "traced" and not drawer.centred:
                raise OptionError(f"integrator {drawer.name} sends rays through all of a pixel, "
                                  "of which none is rasterised; take first_hits=traced")
            with self._logged():
                rays, buffers = self._room(drawer.size)
                buffers.keep(drawer.packed_sizes)
                driver = self._driver(first_hits)
                began = time.perf_counter()
                waves = Waves(driver, buffers, self.statistics, self._count)
                try:
                    pixels = waves.draw(drawer, rays, camera or self.scene.camera)
                    self.gpu.check_error("rendering")
                finally:    # also of a picture that was interrupted
                    self.statistics.trace_seconds = time.perf_counter() - began
            self._add_texture_bytes()
        return Image.fromarray(pixels)

    @property
    def radiance(self) -> np.ndarray:
        """(height, width, 3) float32, linear: what the last picture by "path" shows, row 0 at the
        top, before it is cut off at white."""
        found = self._integrator.radiance if self._integrator is not None else None
        if found is None:
            raise Error('there is no radiance yet; render with integrator="path"')
        return found

    def unfinished(self) -> Image.Image | None:
        """What there is of a picture by "path" that was interrupted; None where there is nothing.
        ``statistics.samples`` says how many samples a pixel have been taken."""
        found = self._integrator.radiance if self._integrator is not None else None
        return None if found is None else Image.fromarray(shown(found.astype(np.float64)))

    @memory_limited
    def eye_hits(self, camera: Camera | None = None, size: tuple[int, int] = (512, 512),
                 first_hits: str = "traced") -> Hits:
        """Hits of the eye rays of ``render``, row by row from the top.

        Parameters
        ----------
        camera, size, first_hits : as for ``render``, which also says what is raised
        """
        check_camera(camera)
        width, height = image_size(size)
        with self._taking(COHERENT), self._logged():
            self.statistics.start_call(width * height)
            rays, buffers = self._room((width, height))
            driver = self._driver(first_hits)
            eye = EyeRays(self.gpu, self.precision)
            eye.write(rays, camera or self.scene.camera, self.scene.bounds)
            self.gpu.finish()
            began = time.perf_counter()
            side, self.statistics.stopped = driver.run(rays, buffers, self.statistics)
            self.gpu.finish()
            self.statistics.trace_seconds = time.perf_counter() - began
            hits = self._finish(hits_of(side.fields(HIT.name)), side, self.statistics.stopped)
            eye.release()
            self.gpu.check_error("tracing eye rays")
            self.statistics.readback_seconds = (time.perf_counter() - began
                                                - self.statistics.trace_seconds)
        return hits

    def _driver(self, first_hits: str) -> Driver:
        """What traces a picture's rays."""
        return self._eye_drivers.over(self._traversal, first_hits, self._hit_triangles())

    def _hit_triangles(self) -> np.ndarray:
        """(n, 3, 3) float32: what rays are tested against, in the order that hits count."""
        coarser = self.accelerator.shown is not None
        return self._builder.stored(self._shown()) if coarser else self._triangles

    def plan(self, size: tuple[int, int] = (512, 512), integrator: str | None = None,
             **options: Any) -> Plan:
        """What `render` with the same arguments would do and allocate, and why no more.

        Parameters
        ----------
        size, integrator, options : as for ``render``, which also says what is raised
        """
        with self._taking(find_integrator(integrator).rays):
            drawer = self._drawer(Region.of(size, None), integrator, options)
            rays, buffers = self._room(drawer.size)
            buffers.side(0)
            buffers.keep(drawer.packed_sizes)
            return Plan.of(drawer, {
                **{f"the method's {name}": taken
                   for name, taken in self.statistics.table_bytes.items()},
                "eye rays": texture_bytes(rays.textures), "state and hits": buffers.bytes()})

    def _drawer(self, region: Region, integrator: str | None,
                options: Mapping[str, Any]) -> Integrator:
        """The integrator, with room for a picture; the last one if it is asked for the same."""
        kind = find_integrator(integrator)
        asked, last = kind.asked(options, self.precision), self._integrator
        needs = SceneNeeds.of(self.scene, asked)
        with self.gpu:
            if last is None or type(last) is not kind or last.needs != needs:
                release(last)
                self._integrator = kind(self.gpu, self._shown(), needs,
                                        self.options["intersection"])
            assert self._integrator is not None
            self.statistics.start_call(region.size[0] * region.size[1])
            self._integrator.start(region, options)
        return self._integrator
