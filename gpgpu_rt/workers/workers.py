"""Workers: a Dask scheduler's processes, each with an OpenGL context of its own."""
from __future__ import annotations

import hashlib
import pickle
import uuid
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import Error, OptionError
from ..hits import Hits, joined
from ..methods import find_method
from ..options import TRACER_OPTIONS, resolve_options
from ..ray_state import RayBatch
from ..scene import Scene, load_scene
from . import tasks

LOCAL = "local"
RETRIES = 3         # of a task whose worker failed or was killed
MOST_KEPT = 16      # scenes and structures that workers go on holding
PART = 1 << 16      # rays of a part, at least
PATIENCE = "10s"    # for a scheduler to answer


class Workers:
    """Processes that trace, here or on other machines.

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
        where Dask is not installed, or no scheduler answers

    Notes
    -----
    Scenes are sent once, structures built once and sent as files of the cache, both known by
    their content. A worker that is killed loses nothing: its tasks run again elsewhere. Local
    processes start by "spawn": a script that opens them needs ``if __name__ == "__main__":``.
    """

    def __init__(self, scheduler: str = LOCAL, count: int | None = None,
                 threads: int | None = None) -> None:
        try:
            import distributed
        except ImportError as failure:
            raise Error("workers are Dask's: pip install 'gpgpu_rt[workers]'") from failure
        if count is not None and count < 1:
            raise OptionError(f"{count} workers do nothing; give 1 or more")
        self._cluster = None
        address = scheduler
        if scheduler == LOCAL:
            self._cluster = address = distributed.LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=":0",
                env={} if threads is None else {"LP_NUM_THREADS": str(threads)})
        try:
            self.client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as failure:
            if self._cluster is not None:
                self._cluster.close()
            raise Error(f"no Dask scheduler answers at {scheduler} ({failure}); start one with "
                        "`dask scheduler`, or say local") from failure
        self._futures: OrderedDict[tuple[Any, ...], Any] = OrderedDict()   # the last ones

    def __len__(self) -> int:
        return len(self.client.scheduler_info(n_workers=-1)["workers"])

    def map(self, function: Callable[..., Any], parts: Iterable[Sequence[Any]],
            progress: Callable[[int, int], None] | None = None) -> Iterator[tuple[int, Any]]:
        """``function(*part)`` for each part, in whatever order they are done.

        Yields (index of the part, result). ``progress`` is told parts done, and of how many.
        """
        import distributed
        futures = [self.client.submit(function, *part, pure=False, retries=RETRIES)
                   for part in parts]
        index = {future.key: at for at, future in enumerate(futures)}
        try:
            finished = distributed.as_completed(futures, loop=self.client.loop)
            for done, future in enumerate(finished, 1):
                yield index[future.key], future.result()
                if progress is not None:
                    progress(done, len(futures))
        finally:
            self.client.cancel(futures)    # where the caller goes before the end

    def trace(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray,
              method: str = "bvh-threaded", t_min: float | np.ndarray = 0.0,
              t_max: float | np.ndarray = np.inf, invalid: str = "raise",
              progress: Callable[[int, int], None] | None = None, **options: Any) -> Hits:
        """Nearest hits, as ``Tracer(scene, method, **options).trace`` finds them.

        Parameters
        ----------
        origins, directions : (n, 3) or (h, w, 3) float, world units
        t_min, t_max : scalars or one a ray
        invalid : "raise", or "miss": rays with NaN, infinity or no direction get status 1
        progress : is told parts done, and of how many
        """
        return joined(self._rays(scene, origins, directions, method, t_min, t_max, invalid,
                                 options, False, progress))

    def occluded(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray,
                 method: str = "bvh-threaded", t_max: float | np.ndarray = np.inf,
                 t_min: float | np.ndarray = 0.0,
                 invalid: str = "raise", progress: Callable[[int, int], None] | None = None,
                 **options: Any) -> np.ndarray:
        """(n,) bool: whether anything lies in [t_min, t_max] of each ray."""
        return np.concatenate(self._rays(scene, origins, directions, method, t_min, t_max,
                                         invalid, options, True, progress))

    def _rays(self, scene: Scene | str, origins: np.ndarray, directions: np.ndarray, method: str,
              t_min: float | np.ndarray, t_max: float | np.ndarray, invalid: str,
              options: Mapping[str, Any], any_hit: bool,
              progress: Callable[[int, int], None] | None) -> list[Any]:
        RayBatch(origins, directions, t_min, t_max, invalid=invalid)   # a mistake is told here
        origins, directions = (np.asarray(a, np.float32).reshape(-1, 3)
                               for a in (origins, directions))
        count = max(1, min(4 * len(self), len(origins) // PART))
        ends = np.linspace(0, len(origins), count + 1).astype(np.int64)
        one_a_ray = {name: np.asarray(t, np.float32) for name, t in (("t_min", t_min),
                                                                     ("t_max", t_max))}
        shared = self.shared(scene, method, options)
        found: list[Any] = [None] * count
        for at, part in self.map(tasks.trace, [
                (*shared, {"origins": origins[lo:hi], "directions": directions[lo:hi],
                           "invalid": "miss",
                           **{name: t if t.size == 1 else t.reshape(-1)[lo:hi]
                              for name, t in one_a_ray.items()}}, any_hit)
                for lo, hi in zip(ends[:-1], ends[1:])], progress):
            found[at] = part
        return found

    def shared(self, scene: Scene | str, method: str,
               options: Mapping[str, Any]) -> tuple[Any, ...]:
        """What tasks that trace take first: the scene and what was built for it, both futures,
        then the scene's digest, the method and its options."""
        scene, row = load_scene(scene), find_method(method)
        resolve_options(options, TRACER_OPTIONS + row.options, f"method {method}")
        digest = hashlib.sha256(pickle.dumps(scene, pickle.HIGHEST_PROTOCOL)).hexdigest()
        chosen = tuple(sorted((name, tuple(value) if isinstance(value, list) else value)
                              for name, value in options.items()))
        # Tasks and not scattered data, so that they outlive the workers that hold them.
        sent = self._kept((digest,), lambda: self.client.submit(
            tasks.received, scene, key=f"scene-{digest}-{uuid.uuid4().hex}", retries=RETRIES))
        built = self._kept((digest, method, chosen), lambda: self.client.submit(
            tasks.structures, sent, digest, method, chosen, pure=False, retries=RETRIES))
        return sent, built, digest, method, chosen

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
        self.client.close()
        if self._cluster is not None:
            self._cluster.close()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
