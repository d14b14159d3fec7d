"""Workers: the processes of a Dask scheduler, each with its own OpenGL context."""
from __future__ import annotations

import contextlib
import os
import signal
import uuid
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from typing import Any

import numpy as np
from PIL import Image

from ..errors import Error, OptionError, how_to_install
from ..hits import Hits, joined
from ..methods import find_method
from ..rays.batch import RayBatch
from ..scene.animation import Animation, load_animation
from ..scene.camera import Camera
from ..scene.loading import load_scene
from ..scene.region import Region
from ..scene.scene import Scene
from . import logs, tasks
from .digest import digest
from .local import local_cluster

LOCAL = "local"
MOST_KEPT = 16      # number of scenes and structures that stay in the workers' memory
PART = 1 << 16      # smallest number of rays in a part, approximately
# The number of image rows in each part, except the last, is a multiple of ROWS. So each packet of
# a part is also a packet of the whole image.
ROWS = 8
PATIENCE = "10s"    # time to wait for a scheduler's answer, and for its first worker
TILE = 128          # side in pixels of the tiles that workers draw

# Called with the number of finished parts, and the number of all parts.
Progress = Callable[[int, int], None]


class Workers:
    """Processes that trace and draw, on this machine or on other machines.

    Parameters
    ----------
    scheduler : "local" for processes of this machine; or the address of a Dask scheduler, such as
        ``tcp://host:8786``, whose workers have this package
    count : number of local processes; None for one on each core
    threads : threads of the software renderer in a local process (``LP_NUM_THREADS``); None keeps
        the default

    Raises
    ------
    Error
        if Dask is not installed, no scheduler answers, or the scheduler has no workers
    OptionError
        if ``count`` or ``threads`` is not a positive integer, or ``scheduler`` is not a string

    Notes
    -----
    A scene is sent once. A structure is built once and sent as cache files. If a worker is killed,
    other workers run its tasks. Local processes start by "spawn", so a script that opens them
    needs ``if __name__ == "__main__":``. Opening local processes sets Dask's
    ``distributed.deploy.lost-worker-timeout`` in this process.
    """

    def __init__(self, scheduler: str = LOCAL, count: int | None = None,
                 threads: int | None = None) -> None:
        try:
            import distributed
        except ImportError as failure:
            raise Error(f"workers need Dask; {how_to_install('workers')}") from failure
        if not isinstance(scheduler, str):
            raise OptionError(f"scheduler is {scheduler!r}; give local, or a Dask scheduler's "
                              "address")
        for name, number in (("count", count), ("threads", threads)):
            if number is not None and not (isinstance(number, (int, np.integer)) and number >= 1):
                raise OptionError(f"{name} is {number!r}; give a whole number of 1 or more")
        self._cluster: Any = None
        self._silence = contextlib.ExitStack()
        self.scheduler = address = scheduler
        if scheduler == LOCAL:
            if distributed.utils.get_mp_context().get_start_method() == "fork":
                raise Error("Dask is set to fork its workers, but an OpenGL context does not work "
                            "after a fork; set DASK_DISTRIBUTED__WORKER__MULTIPROCESSING_METHOD="
                            "spawn")
            self._cluster = address = local_cluster(count, threads)
        try:
            self._connect(address)
        except BaseException:       # including an interrupt
            self._close_cluster()
            raise
        # The MOST_KEPT most recently used futures.
        self._futures: OrderedDict[tuple[Any, ...], Any] = OrderedDict()

    def _connect(self, address: Any) -> None:
        import distributed
        try:
            # Check the address first: a Client with an invalid address hangs when it is deleted.
            if address == self.scheduler:
                distributed.comm.resolve_address(address)
                if address.startswith("tls://") and not distributed.Security().get_connection_args(
                        "client")["ssl_context"]:
                    raise ValueError("TLS needs a certificate: see docs/workers.md")
                self._silence.enter_context(logs.silenced())
            self._client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as failure:
            raise Error(f"no Dask scheduler answers at {address} ({failure}); start one with "
                        "`dask scheduler`, or use local") from failure
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as failure:
            self._client.close()
            raise Error(f"the Dask scheduler at {address} has no workers; start some with "
                        f"`dask worker --nthreads 1 {address}`") from failure

    @property
    def client(self) -> Any:
        """Dask's client. Raises Error if these workers were closed."""
        if self._client.status == "closed":
            raise Error("these workers were closed, for example by the end of their `with` block; "
                        "open new workers")
        return self._client

    def processes(self) -> list[int]:
        """Return the present ids of the local processes; a killed process restarts with a new
        id."""
        nannies = self._cluster.workers.values() if self._cluster is not None else ()
        return [nanny.pid for nanny in nannies if nanny.pid]

    def __len__(self) -> int:
        return len(self.client.scheduler_info(n_workers=-1)["workers"])

    def map(self, function: Callable[..., Any], parts: Iterable[Sequence[Any]],
            progress: Progress | None = None) -> Iterator[tuple[int, Any]]:
        """Yield (index of the part, ``function(*part)``) for each part, in order of completion.

        ``progress`` is called with the number of finished parts and of all parts.

        Raises
        ------
        Error
            if workers died repeatedly at the same part, the scheduler ended, or workers lack a
            module. Errors of ``function`` are also raised
        """
        import distributed
        futures = [self.client.submit(function, *part, pure=False) for part in parts]
        finished = distributed.as_completed(futures, loop=self.client.loop)
        waiting = {future.key: (at, future) for at, future in enumerate(futures)}
        count = len(futures)
        del futures     # workers keep a result until its future is deleted
        try:
            for done, future in enumerate(finished, 1):
                at, _ = waiting.pop(future.key)
                with _in_a_line():
                    result = future.result()
                del future, _
                yield at, result
                if progress is not None:
                    progress(done, count)
        finally:    # if the caller stops early, cancel the parts that are not finished
            with _in_a_line():
                self.client.cancel([future for _, future in waiting.values()])

    def trace(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray,
              method: str = "bvh-threaded", t_min: float | np.ndarray = 0.0,
              t_max: float | np.ndarray = np.inf, shape: tuple[int, int] | None = None,
              invalid: str = "raise", progress: Progress | None = None, **options: Any) -> Hits:
        """Return the nearest hits, the same as ``Tracer(scene, method, **options).trace``.

        Parameters
        ----------
        scene : Scene, or the name of a scene
        origins, directions : (n, 3) or (h, w, 3) float, world units
        method, options : as for ``Tracer``
        t_min, t_max : scalars, or a value per ray
        shape : (h, w) of the image that (n, 3) rays form
        invalid : for rays with NaN, infinity or a zero direction: "raise", or "miss" (status 1)
        progress : called with the number of finished parts and of all parts

        Raises
        ------
        ValueError
            if shapes do not match, or a ray is invalid; the message names the first invalid ray
        Error
            as for ``map``; and the errors of ``Tracer``
        """
        hits = joined(self._rays(scene, origins, directions, method, t_min, t_max, shape, invalid,
                                 options, False, progress))
        hits.shape = tuple(shape or np.shape(origins)[:-1])
        return hits

    def occluded(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray,
                 method: str = "bvh-threaded", t_max: float | np.ndarray = np.inf,
                 t_min: float | np.ndarray = 0.0, shape: tuple[int, int] | None = None,
                 invalid: str = "raise", progress: Progress | None = None,
                 **options: Any) -> np.ndarray:
        """Return whether each ray hits any triangle in [t_min, t_max], (n,) bool.

        Parameters
        ----------
        scene, method, options : as for ``trace``
        origins, directions, t_max, t_min, shape, invalid, progress : as for ``trace``

        Raises
        ------
        ValueError, Error
            as for ``trace`` and ``Tracer.occluded``
        """
        return np.concatenate(self._rays(scene, origins, directions, method, t_min, t_max, shape,
                                         invalid, options, True, progress))

    def render(self, scene: Scene | str, method: str = "bvh-threaded",
               size: tuple[int, int] = (512, 512), camera: Camera | None = None,
               integrator: str | None = None, picture: Mapping[str, Any] = {},
               tile: int = TILE, progress: Progress | None = None,
               **options: Any) -> Image.Image:
        """Return the picture of ``Tracer(scene, method, **options).render``, drawn in tiles.

        Parameters
        ----------
        scene, method, options : as for ``trace``
        size, camera, integrator : as for ``Tracer.render``
        picture : the integrator's options
        tile : side of a tile in pixels
        progress : called with the number of finished tiles and of all tiles

        Raises
        ------
        OptionError
            as for ``Tracer.render``, or if ``picture`` sets ``noise``, which needs the whole
            picture
        """
        whole = Region.of(size, None)
        tiles = whole.tiles(tile)
        pixels = np.zeros((*size[::-1], 3), np.uint8)
        for at, drawn in self.draw(scene, tiles, method, progress, {
                **picture, "camera": camera, "integrator": integrator}, **options):
            x, y, width, height = tiles[at].box
            pixels[y:y + height, x:x + width] = drawn
        return Image.fromarray(pixels)

    def draw(self, scene: Scene | str, regions: Sequence[Region], method: str,
             progress: Progress | None, drawing: Mapping[str, Any],
             **options: Any) -> Iterator[tuple[int, np.ndarray]]:
        """Yield (index, (height, width, 3) uint8) for each region, in order of completion.

        ``drawing`` holds the arguments of ``Tracer.render`` except size and region.
        """
        check_parts(drawing)
        shared = self.shared(scene, method, options)
        return self.map(tasks.draw, [(*shared, {**drawing, "size": region.whole}, region.box)
                                     for region in regions], progress)

    def frames(self, animation: Animation | str, frames: Sequence[int],
               method: str = "bvh-threaded", progress: Progress | None = None,
               drawing: Mapping[str, Any] = {},
               **options: Any) -> Iterator[tuple[int, np.ndarray]]:
        """Yield (frame, (height, width, 3) uint8) for each frame, in order of completion.

        Parameters
        ----------
        animation : An Animation, or the name of a moving scene.
        frames : Numbers of the frames.
        method, options : As for ``trace``.
        progress : Called with the number of finished frames and of all frames.
        drawing : Arguments of ``Tracer.render``. The default camera is the animation's moving
            camera.
        """
        animation = load_animation(animation) if isinstance(animation, str) else animation
        shared = *self.shared(animation.scene, method, options), self.sent(animation.vertices)
        each = [(*shared, animation.drawing(frame, drawing), frame) for frame in frames]
        for at, drawn in self.map(tasks.draw_frame, each, progress):
            yield frames[at], drawn

    def renderers(self) -> list[str]:
        """Return the names of the workers' renderers. Parts of a picture from different renderers
        may differ in the last bit."""
        with _in_a_line():
            return sorted(set(self.client.run(tasks.renderer).values()))

    def _rays(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray, method: str,
              t_min: float | np.ndarray, t_max: float | np.ndarray,
              shape: tuple[int, int] | None, invalid: str, options: Mapping[str, Any],
              any_hit: bool, progress: Progress | None) -> list[Any]:
        with np.errstate(over="ignore"):    # a value beyond the range of float32 becomes infinity
            # Report wrong arguments here, before rays are sent.
            width = RayBatch(origins, directions, t_min, t_max, shape, invalid).size[0]
            rays = {name: np.asarray(values, np.float32) for name, values in (
                ("origins", origins), ("directions", directions), ("t_min", t_min),
                ("t_max", t_max))}
        image = shape is not None or rays["origins"].ndim == 3
        flat = {name: values.reshape(-1, 3) if name in ("origins", "directions") else
                values.reshape(-1) for name, values in rays.items()}
        total, together = len(flat["origins"]), ROWS * width if image else 1
        count = max(1, min(4 * len(self), total // PART, total // together))
        ends = np.linspace(0, total / together, count + 1).round().astype(np.int64) * together
        ends[-1] = total
        shared = self.shared(scene, method, options)
        found: list[Any] = [None] * count
        for at, part in self.map(tasks.trace, [
                (*shared, {**{name: values if len(values) == 1 else values[lo:hi]
                              for name, values in flat.items()},
                           "shape": ((hi - lo) // width, width) if image else None,
                           "invalid": "miss"}, any_hit)
                for lo, hi in zip(ends[:-1], ends[1:])], progress):
            found[at] = part
        return found

    def shared(self, scene: Scene | str, method: str,
               options: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return the first arguments of all tasks: the scene's future, the structures' future, the
        scene's digest, the method and its options."""
        scene, row = load_scene(scene), find_method(method)
        if row.resolved(options).get("workers", 1) > 1:
            raise OptionError("a Dask worker cannot start processes for a build; leave the option "
                              "workers at 1")
        content = digest(scene)
        chosen = tuple(sorted((name, tuple(value) if isinstance(value, list) else value)
                              for name, value in options.items()))
        sent = self.sent(scene, content)
        built = self._kept((content, method, chosen), lambda: self.client.submit(
            tasks.structures, sent, content, method, chosen, pure=False))
        return sent, built, content, method, chosen

    def sent(self, value: Any, content: str | None = None) -> Any:
        """Send a value once and return its future. ``content`` is its digest."""
        content = content or digest(value)
        # Use a task, not scattered data: Dask runs a task again if its worker dies.
        return self._kept((content,), lambda: self.client.submit(
            tasks.received, value, key=f"sent-{content}-{uuid.uuid4().hex}"))

    def _kept(self, key: tuple[Any, ...], submit: Callable[[], Any]) -> Any:
        """Return a key's future. Submit the task again if its future is missing or has failed."""
        if key not in self._futures or self._futures[key].status not in ("pending", "finished"):
            self._futures[key] = submit()
        self._futures.move_to_end(key)
        while len(self._futures) > MOST_KEPT:
            self._futures.popitem(last=False)
        return self._futures[key]

    def close(self) -> None:
        """End the local processes. Workers of a scheduler at an address keep running."""
        self._client.close()
        self._close_cluster()

    def _close_cluster(self) -> None:
        if self._cluster is not None:
            processes = self.processes()
            try:
                self._cluster.close()
            except TimeoutError:    # on a busy machine, Dask gives up early
                for process in processes:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(process, getattr(signal, "SIGKILL", signal.SIGTERM))
        self._silence.close()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def check_parts(drawing: Mapping[str, Any]) -> None:
    """Raise OptionError if the ``drawing`` arguments need a whole picture."""
    if drawing.get("noise") is not None:
        raise OptionError("noise is measured over a whole picture, but a worker draws only a "
                          "part; give samples instead")
    if drawing.get("first_hits", "traced") != "traced":
        raise OptionError("the rasteriser needs the whole picture, but a worker draws only a "
                          "part; use first_hits=traced")


@contextlib.contextmanager
def _in_a_line() -> Iterator[None]:
    """Return a context that turns Dask's exceptions into an Error with a single line."""
    import distributed
    try:
        yield
    except distributed.KilledWorker as failure:
        raise Error("workers could not finish a part: workers died repeatedly; give each worker "
                    "more memory, if memory was the reason") from failure
    except (CancelledError, distributed.comm.CommClosedError) as failure:
        raise Error("workers could not finish a part: their scheduler ended, or cancelled the "
                    "part; start the scheduler again") from failure
    except ImportError as failure:
        raise Error(f"workers lack a module that a part needs ({failure}); install the same "
                    "gpgpu_rt on their machines") from failure
