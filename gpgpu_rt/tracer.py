"""Tracer: the public class that traces rays through a scene and draws pictures of it."""
from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from typing import Any, TypeAlias

import numpy as np
from PIL import Image

from . import views
from .gl.context import open_gpu
from .gl.observation import ObservedPass, Passes, observe
from .gl.pass_log import PassLog
from .gl.precision import Precision
from .hits import Hits, check_decided
from .methods import Accelerator, Method, settings
from .methods.choices import COHERENT, Choice, Choices
from .methods.names import MethodName
from .numerics.public_call import public_call
from .options import TRACER_OPTIONS, lists
from .rays.batch import RayBatch
from .render.integrators import find_integrator
from .render.plan import Plan
from .scene.camera import Camera, check_camera, image_size
from .scene.lazy_trimesh import trimesh
from .scene.loading import load_scene
from .scene.region import Region
from .scene.scene import Scene
from .session.all_hits import AllHits, check_exact
from .session.build_ahead import move_ahead
from .session.session import Session
from .session.sessions import Sessions

DEFAULT_METHOD, AUTO = "bvh-threaded", "auto"
Source: TypeAlias = "Scene | trimesh.Trimesh | str | os.PathLike[str]"    # for `load_scene`


@lists(TRACER_OPTIONS)
class Tracer:
    """Traces rays through a scene with one of the methods of ``methods()``.

    Parameters
    ----------
    scene : Scene, trimesh.Trimesh, a scene's name or a mesh file
    method : a name from ``methods()``, "auto", or ``Choices``: a method for coherent rays and a
        method for incoherent rays. The second accelerator is built when it is first needed.
        ``statistics.choice``, ``method`` and ``options`` describe the method of the last call.
        "auto" uses `tune`'s ``Choices`` for this scene and renderer, or else a safe default
    options : the options below, and the options that ``gpgpu-rt methods NAME`` prints for a method

    Raises
    ------
    OptionError, SceneError, ContextError, ShaderError, LimitError

    Notes
    -----
    ``release``, or the end of a ``with`` block, frees textures and programs. Threads may share a
    tracer or have their own tracers; only one thread at a time uses the OpenGL context.
    ``statistics`` describes the last call of any thread. Processes must start by "spawn", because
    a context does not survive a fork. A pickled tracer is made anew in the process that reads it.
    """

    @public_call
    def __init__(self, scene: Source, method: MethodName | str | Choices = DEFAULT_METHOD,
                 **options: Any) -> None:
        self.settings: settings.Settings | None = None   # set by "auto" and by from_settings
        if method == AUTO:
            scene = load_scene(scene)
            method, self.settings = settings.automatic(
                scene, open_gpu(options.get("context")).renderer, options)
        elif isinstance(method, Choices):
            method = method.with_options(options, "the choices")
        else:
            method = Choices.one(Choice(method, options))
        rows = method.resolved()    # refuse a wrong option before reading a large mesh
        self.sessions = Sessions(method, rows, load_scene(scene))
        self.gpu, self.statistics = self.sessions.gpu, self.sessions.statistics

    @classmethod
    def from_settings(cls, scene: Source, path: str | os.PathLike[str],
                      force: bool = False, **options: Any) -> Tracer:
        """Return a tracer with the methods and options of a settings file.

        Parameters
        ----------
        path : a file that `gpgpu-rt tune` wrote
        force : use the file even if it was made for another scene or renderer; its error bounds
            are then not guaranteed
        options : more options. Only ``statistics`` and ``context`` may differ from the file

        Raises
        ------
        SettingsError, OptionError
            if the file was made for another scene or renderer; if an option contradicts the file
        """
        found, scene = settings.load(path), load_scene(scene)
        if not force:
            found.check_fits(scene, open_gpu(options.get("context")).renderer, str(path))
        tracer = cls(scene, found.choices.with_options(options, str(path)))
        tracer.settings = found
        return tracer

    @property
    def session(self) -> Session:
        """The session of the last call: accelerator, driver and textures."""
        return self.sessions.present

    @property
    def pass_log(self) -> PassLog | None:
        """The passes of the last call; None without the option ``statistics``."""
        return self.sessions.pass_log

    @property
    def choices(self) -> Choices:
        """The methods for coherent and for incoherent rays."""
        return self.sessions.choices

    @property
    def taken(self) -> str:
        """The kind of rays that the last call's method is for: "coherent" or "incoherent"."""
        return self.sessions.chosen

    @property
    def method(self) -> Method:
        """The last call's method: its row of the method table, adapted to the options."""
        return self.session.method

    @property
    def options(self) -> dict[str, Any]:
        """Every option of the tracer and of the method."""
        return self.session.options

    @property
    def precision(self) -> Precision:
        """The number formats of textures and of arithmetic, and their rounding."""
        return self.session.structure.precision

    @property
    def scene(self) -> Scene:
        """The scene with its present triangles."""
        return self.session.scene

    @property
    def accelerator(self) -> Accelerator:
        """The tables, uniforms and defines that the method's programs read."""
        return self.session.accelerator

    @property
    def step_cap(self) -> int:
        """Steps after which a ray is stopped and flagged."""
        return self.session.step_cap

    # Tracing --------------------------------------------------------------------------------

    @public_call
    def trace(self, origins: np.ndarray, directions: np.ndarray,
              t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
              shape: tuple[int, int] | None = None, invalid: str = "raise") -> Hits:
        """Find each ray's nearest hit.

        Parameters
        ----------
        origins, directions : (n, 3) or (h, w, 3) float, world units; directions of any length
        t_min, t_max : numbers, or a value per ray, in units of |direction|; both ends are included
        shape : (h, w) of the image that (n, 3) rays form
        invalid : treatment of rays with a NaN, an infinity or a zero direction: "raise" an error,
            or "miss" to give the ray status 1

        Raises
        ------
        ValueError
            if shapes do not match, or a ray is invalid; the message names the first invalid ray
        Error
            after ``release``
        """
        batch = self._batch(origins, directions, t_min, t_max, shape, invalid)
        with self.sessions.call(batch) as session:
            return session.trace(batch, False, self.statistics)

    @public_call
    def occluded(self, origins: np.ndarray, directions: np.ndarray,
                 t_max: float | np.ndarray = np.inf, t_min: float | np.ndarray = 0.0,
                 shape: tuple[int, int] | None = None, invalid: str = "raise") -> np.ndarray:
        """Return (n,) bool, whether each ray hits any triangle in [t_min, t_max]. A ray ends at
        the first hit that is found.

        Parameters
        ----------
        origins, directions, t_max, t_min, shape, invalid : as for ``trace``

        Raises
        ------
        ValueError
            as for ``trace``
        Error
            as for ``trace``, and if the step cap or a full stack stops a ray before a hit is found
        """
        batch = self._batch(origins, directions, t_min, t_max, shape, invalid)
        with self.sessions.call(batch) as session:
            hits = session.trace(batch, True, self.statistics)
            check_decided(hits, session.step_cap)
        return hits.hit

    @public_call
    def trace_all(self, origins: np.ndarray, directions: np.ndarray,
                  t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
                  shape: tuple[int, int] | None = None, invalid: str = "raise",
                  max_hits: int | None = None) -> AllHits:
        """Find all hits of each ray, sorted by (t, triangle).

        All coincident triangles count. Each round of passes finds the next hit of every ray that
        had a hit in the previous round. ``statistics`` sums over all rounds, without counters.

        Parameters
        ----------
        origins, directions, t_min, t_max, shape, invalid : as for ``trace``
        max_hits : find at most this many of the nearest hits per ray; None finds all hits

        Raises
        ------
        ValueError
            as for ``trace``
        OptionError
            for options that may lose hits, or that round t, so that two t could become equal
        """
        for method, own in self.sessions.rows.values():
            check_exact(method, own)
        batch = self._batch(origins, directions, t_min, t_max, shape, invalid)
        with self.sessions.call(batch) as session:
            return session.trace_all(batch, max_hits, self.statistics)

    def _batch(self, origins: np.ndarray, directions: np.ndarray, t_min: float | np.ndarray,
               t_max: float | np.ndarray, shape: tuple[int, int] | None,
               invalid: str) -> RayBatch:
        return RayBatch(origins, directions, t_min, t_max, shape, invalid,
                        self.session.structure.bounds, self.sessions.any_packets)

    # Pictures -------------------------------------------------------------------------------

    @public_call
    def render(self, camera: Camera | None = None, size: tuple[int, int] = (512, 512),
               integrator: str | None = None,
               progress: Callable[[int, int, float], None] | None = None,
               first_hits: str = "traced",
               region: tuple[int, int, int, int] | None = None,
               **options: Any) -> Image.Image:
        """Draw a picture of the scene; this tracer's method traces the picture's rays.

        Parameters
        ----------
        camera : Camera, or None for the scene's own camera.
        size : Pixels, (width, height).
        integrator : "direct" shows light and shadows; "whitted" (default) adds mirrors and glass;
            "path" adds light that bounces. After "path", ``radiance`` holds the unclipped result.
        progress : Called as progress(samples done, samples in total, noise so far, or infinity).
        first_hits : With "traced", the method traces all eye rays. With "rasterised", the
            rasteriser finds their hits, and the method traces the eye rays whose hit is in doubt;
            hits equal traced hits to the bit. With "verified", each eye ray is only proved to hit
            the triangle that its pixel shows, so a few pixels may show a triangle behind another.
            ``statistics.first_hits`` counts the traced eye rays.
        region : Pixels to draw, (x, y, width, height) from the top left, the same to the bit as in
            the whole picture; None draws all. With a region, the option ``noise`` of "path"
            applies to the region.
        options : Options of the integrator; ``integrators.INTEGRATORS[name].options`` lists them.

        Raises
        ------
        OptionError
            for a camera, size, integrator, option or region that is not valid
        LimitError
            for a picture too large for this renderer
        KeyboardInterrupt
            on Ctrl-C; ``unfinished`` gives the picture of "path" so far
        """
        check_camera(camera)
        with self.sessions.call(find_integrator(integrator).rays) as session:
            return self.sessions.pictures.render(session, camera, Region.of(size, region),
                                                 integrator, progress, first_hits, options)

    @property
    def radiance(self) -> np.ndarray:
        """The last picture by "path", (height, width, 3) float32, linear, not clipped."""
        return self.sessions.pictures.radiance

    def unfinished(self) -> Image.Image | None:
        """Return the picture of "path" at its interruption, or None."""
        return self.sessions.pictures.unfinished()

    @public_call
    def eye_hits(self, camera: Camera | None = None, size: tuple[int, int] = (512, 512),
                 first_hits: str = "traced") -> Hits:
        """Find the hits of the eye rays of ``render``, row by row from the top.

        Parameters
        ----------
        camera, size, first_hits : as for ``render``, which also lists the errors
        """
        check_camera(camera)
        size = image_size(size)
        with self.sessions.call(COHERENT) as session:
            return self.sessions.pictures.eye_hits(session, camera, size, first_hits)

    @public_call
    def plan(self, size: tuple[int, int] = (512, 512), integrator: str | None = None,
             **options: Any) -> Plan:
        """Return the plan of `render`, without drawing: the passes, textures and defines that
        `render` would use. The plan also lists what `render` would omit, with the reasons.

        Parameters
        ----------
        size, integrator, options : as for ``render``, which also lists the errors
        """
        with self.sessions.turn(find_integrator(integrator).rays) as session:
            return self.sessions.pictures.plan(session, Region.of(size, None), integrator, options)

    # Moving ---------------------------------------------------------------------------------

    @public_call
    def update(self, vertices: np.ndarray) -> None:
        """Move the scene's triangles.

        A method with a ``Method.refit`` adapts its structure, unless the SAH cost exceeds
        ``rebuild_ratio`` times the cost of the last build. Otherwise, the structure is built anew,
        and ``statistics.rebuilt`` is True. ``scene`` becomes a new object.

        Parameters
        ----------
        vertices : (v, 3) float, world units, the vertices that the scene's faces index; or
            (n, 3, 3), the triangles themselves, as many as before

        Raises
        ------
        SceneError, LimitError
        OptionError
            within ``counting``
        """
        with self.sessions.moving() as session:
            session.move(self.scene.moved(vertices))

    def updates(self, positions: Iterable[np.ndarray]) -> Iterator[None]:
        """Move the triangles to each element of ``positions``, as ``update`` does. While a frame
        is traced, another process builds the next structure (Budge et al. 2008)."""
        return move_ahead(self.sessions, positions)

    def counting(self) -> AbstractContextManager[None]:
        """Return a context in which the work of rays is counted, as with ``statistics=True``.

        Calls outside the context are not slowed down.

        Raises
        ------
        OptionError
            for a tracer with two methods. Inside the context, `update` raises this error too
        """
        return self.sessions.counting()

    def observe(self, look: Callable[[ObservedPass], object] | None = None,
                fragments: bool = False) -> AbstractContextManager[Passes]:
        """Return a context that observes each pass: ``with tracer.observe() as passes``.

        Parameters
        ----------
        look : called after each pass, while the pass's textures are unchanged
        fragments : count the fragments and primitives of each pass, by queries

        Returns
        -------
        A context manager that yields a list of ``ObservedPass``, which grows after each draw.
        Passes of other tracers with the same OpenGL context are included.
        """
        return observe(self.gpu, look, fragments)

    # The tracer itself ----------------------------------------------------------------------

    def __repr__(self) -> str:
        return views.line("Tracer", self.sessions.facts())

    def _repr_html_(self) -> str:
        return views.table("Tracer", self.sessions.facts())

    def release(self) -> None:
        """Free textures and programs. The tracer cannot be used afterwards."""
        self.sessions.release()

    def __enter__(self) -> Tracer:
        return self

    def __exit__(self, *exception: object) -> None:
        self.release()

    def __reduce__(self) -> tuple[Any, ...]:
        return Tracer, (self.scene, self.sessions.remade())
