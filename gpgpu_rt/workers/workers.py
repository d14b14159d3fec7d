"""Workers: a Dask scheduler's processes, each with an OpenGL context of its own."""
from __future__ import annotations

import contextlib
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
MOST_KEPT = 16      # scenes and structures that workers go on holding
PART = 1 << 16      # rays of a part, about, at least
# Rows of an image that stay together: packets are tiles of it, the same in a part as in the whole
# where their height divides this.
ROWS = 8
PATIENCE = "10s"    # for a scheduler to answer, and for its first worker
TILE = 128          # pixels a side of what a worker draws of a picture

Progress = Callable[[int, int], None]     # parts done, and of how many


class Workers:
    """Processes that trace and draw, here or on other machines.

    Parameters
    ----------
    scheduler : "local", processes of this machine; or the address of a Dask scheduler, such as
        ``tcp://host:8786``, whose workers have this package
    count : local processes; None for one a core
    threads : that the software renderer of a local process takes (``LP_NUM_THREADS``); None leaves
        it as it is

    Raises
    ------
    Error
        where Dask is not installed, no scheduler answers, or it has no workers
    OptionError
        for a count or threads that are no whole number of 1 or more, a scheduler that is no text

    Notes
    -----
    Scenes are sent once, structures built once and sent as files of the cache, both known by
    their content. A worker that is killed loses nothing: its tasks run again elsewhere. Local
    processes start by "spawn": a script that opens them needs ``if __name__ == "__main__":``.
    In the process that opens them Dask's ``distributed.deploy.lost-worker-timeout`` is set.
    """

    def __init__(self, scheduler: str = LOCAL, count: int | None = None,
                 threads: int | None = None) -> None:
        try:
            import distributed
        except ImportError as failure:
            raise Error(f"workers are Dask's; {how_to_install('workers')}") from failure
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
                raise Error("Dask is set to fork its workers, which no OpenGL context outlives; "
                            "set DASK_DISTRIBUTED__WORKER__MULTIPROCESSING_METHOD=spawn")
            self._cluster = address = local_cluster(count, threads)
        try:
            self._connect(address)
        except BaseException:       # an interrupt too
            self._close_cluster()
            raise
        self._futures: OrderedDict[tuple[Any, ...], Any] = OrderedDict()   # the last ones

    def _connect(self, address: Any) -> None:
        import distributed
        try:
            # A Client that cannot read its address would hang as it is deleted.
            if address == self.scheduler:
                distributed.comm.resolve_address(address)
                if address.startswith("tls://") and not distributed.Security().get_connection_args(
                        "client")["ssl_context"]:
                    raise ValueError("TLS takes a certificate: see docs/workers.md")
                self._silence.enter_context(logs.silenced())
            self._client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as failure:
            raise Error(f"no Dask scheduler answers at {address} ({failure}); start one with "
                        "`dask scheduler`, or say local") from failure
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as failure:
            self._client.close()
            raise Error(f"the Dask scheduler at {address} has no workers; start some with "
                        f"`dask worker --nthreads 1 {address}`") from failure

    @property
    def client(self) -> Any:
        """Dask's client. Error where it was closed."""
        if self._client.status == "closed":
            raise Error("these workers were closed, as their `with` block does at its end; make "
                        "others")
        return self._client

    def processes(self) -> list[int]:
        """Numbers of the local ones, now: one that was killed comes back as another."""
        nannies = self._cluster.workers.values() if self._cluster is not None else ()
        return [nanny.pid for nanny in nannies if nanny.pid]

    def __len__(self) -> int:
        return len(self.client.scheduler_info(n_workers=-1)["workers"])

    def map(self, function: Callable[..., Any], parts: Iterable[Sequence[Any]],
            progress: Progress | None = None) -> Iterator[tuple[int, Any]]:
        """``function(*part)`` for each part, in whatever order they are done.

        Yields (index of the part, result). ``progress`` is told parts done, and of how many.

        Raises
        ------
        Error
            where a part's workers died again and again, the scheduler went, or workers lack a
            module; and whatever ``function`` raises
        """
        import distributed
        futures = [self.client.submit(function, *part, pure=False) for part in parts]
        finished = distributed.as_completed(futures, loop=self.client.loop)
        waiting = {future.key: (at, future) for at, future in enumerate(futures)}
        count = len(futures)
        del futures     # a worker keeps a result as long as its future is held
        try:
            for done, future in enumerate(finished, 1):
                at, _ = waiting.pop(future.key)
                with _in_a_line():
                    result = future.result()
                del future, _
                yield at, result
                if progress is not None:
                    progress(done, count)
        finally:    # where the caller goes before the end
            with _in_a_line():
                self.client.cancel([future for _, future in waiting.values()])

    def trace(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray,
              method: str = "bvh-threaded", t_min: float | np.ndarray = 0.0,
              t_max: float | np.ndarray = np.inf, shape: tuple[int, int] | None = None,
              invalid: str = "raise", progress: Progress | None = None, **options: Any) -> Hits:
        """Nearest hits, as ``Tracer(scene, method, **options).trace`` finds them.

        Parameters
        ----------
        origins, directions : (n, 3) or (h, w, 3) float, world units
        t_min, t_max : scalars or one a ray
        shape : (h, w) of the tile that (n, 3) rays form
        invalid : "raise", or "miss": rays with NaN, infinity or no direction get status 1
        progress : is told parts done, and of how many

        Raises
        ------
        ValueError
            for arrays that do not fit, or naming the first invalid ray
        Error
            as for ``map``; and what ``Tracer`` raises
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
        """(n,) bool: whether anything lies in [t_min, t_max] of each ray.

        Parameters
        ----------
        origins, directions, t_max, t_min, shape, invalid, progress : as for ``trace``

        Raises
        ------
        ValueError, Error
            as for ``trace``, and as ``Tracer.occluded`` does
        """
        return np.concatenate(self._rays(scene, origins, directions, method, t_min, t_max, shape,
                                         invalid, options, True, progress))

    def render(self, scene: Scene | str, method: str = "bvh-threaded",
               size: tuple[int, int] = (512, 512), camera: Camera | None = None,
               integrator: str | None = None, picture: Mapping[str, Any] = {},
               tile: int = TILE, progress: Progress | None = None,
               **options: Any) -> Image.Image:
        """A picture, as ``Tracer(scene, method, **options).render`` draws it, in tiles.

        Parameters
        ----------
        size, camera, integrator : as for ``Tracer.render``
        picture : the integrator's options
        tile : pixels a side of what a worker draws at a time
        progress : is told tiles done, and of how many

        Raises
        ------
        OptionError
            as ``Tracer.render`` raises it, and for ``noise``, which is of a whole picture
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
        """Regions of pictures as they are done: (index, (height, width, 3) uint8).

        ``drawing`` is what ``Tracer.render`` takes besides size and region.
        """
        check_parts(drawing)
        shared = self.shared(scene, method, options)
        return self.map(tasks.draw, [(*shared, {**drawing, "size": region.whole}, region.box)
                                     for region in regions], progress)

    def frames(self, animation: Animation | str, frames: Sequence[int],
               method: str = "bvh-threaded", progress: Progress | None = None,
               drawing: Mapping[str, Any] = {},
               **options: Any) -> Iterator[tuple[int, np.ndarray]]:
        """Frames as they are done: (frame, (height, width, 3) uint8).

        Parameters
        ----------
        animation : one, or the name of a scene that moves
        frames : their numbers
        progress : is told frames done, and of how many
        drawing : what ``Tracer.render`` takes
        """
        animation = load_animation(animation) if isinstance(animation, str) else animation
        shared = *self.shared(animation.scene, method, options), self.sent(animation.vertices)
        for at, drawn in self.map(tasks.draw_frame, [(*shared, drawing, frame)
                                                     for frame in frames], progress):
            yield frames[at], drawn

    def renderers(self) -> list[str]:
        """What the workers draw by: one, or pictures may differ by a bit from part to part."""
        with _in_a_line():
            return sorted(set(self.client.run(tasks.renderer).values()))

    def _rays(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray, method: str,
              t_min: float | np.ndarray, t_max: float | np.ndarray,
              shape: tuple[int, int] | None, invalid: str, options: Mapping[str, Any],
              any_hit: bool, progress: Progress | None) -> list[Any]:
        with np.errstate(over="ignore"):    # what float32 does not hold is infinity
            # A mistake is told here.
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
        """What tasks that trace take first: the scene and what was built for it, both futures,
        then the scene's digest, the method and its options."""
        scene, row = load_scene(scene), find_method(method)
        if row.resolved(options).get("workers", 1) > 1:
            raise OptionError("a worker of Dask's starts no processes of its own; leave "
                              "workers at 1")
        content = digest(scene)
        chosen = tuple(sorted((name, tuple(value) if isinstance(value, list) else value)
                              for name, value in options.items()))
        sent = self.sent(scene, content)
        built = self._kept((content, method, chosen), lambda: self.client.submit(
            tasks.structures, sent, content, method, chosen, pure=False))
        return sent, built, content, method, chosen

    def sent(self, value: Any, content: str | None = None) -> Any:
        """The future of a value that tasks take, sent once; ``content`` is its digest."""
        content = content or digest(value)
        # A task and not scattered data, so that it outlives the workers that hold it.
        return self._kept((content,), lambda: self.client.submit(
            tasks.received, value, key=f"sent-{content}-{uuid.uuid4().hex}"))

    def _kept(self, key: tuple[Any, ...], submit: Callable[[], Any]) -> Any:
        """The future of a key; one that failed is asked for again, old ones are let go."""
        if key not in self._futures or self._futures[key].status not in ("pending", "finished"):
            self._futures[key] = submit()
        self._futures.move_to_end(key)
        while len(self._futures) > MOST_KEPT:
            self._futures.popitem(last=False)
        return self._futures[key]

    def close(self) -> None:
        """End local processes; those of another scheduler are left to it."""
        self._client.close()
        self._close_cluster()

    def _close_cluster(self) -> None:
        if self._cluster is not None:
            self._cluster.close()
        self._silence.close()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def check_parts(drawing: Mapping[str, Any]) -> None:
    """Raise OptionError for what only a whole picture has: ``drawing`` as ``Tracer.render`` takes
    it."""
    if drawing.get("noise") is not None:
        raise OptionError("noise is measured over a whole picture, which no worker draws; "
                          "give samples instead")
    if drawing.get("first_hits", "traced") != "traced":
        raise OptionError("the rasteriser draws whole pictures, which no worker does; take "
                          "first_hits=traced")


@contextlib.contextmanager
def _in_a_line() -> Iterator[None]:
    """Within, what only Dask knows of is told as an Error."""
    import distributed
    try:
        yield
    except distributed.KilledWorker as failure:
        raise Error("workers could not do a part: they died again and again, of too little memory "
                    "perhaps") from failure
    except (CancelledError, distributed.comm.CommClosedError) as failure:
        raise Error("workers could not do a part: their scheduler went, or let it go") from failure
    except ImportError as failure:
        raise Error(f"workers lack what a part needs ({failure}); install the same gpgpu_rt there"
                    ) from failure
