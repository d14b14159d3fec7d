"""Local: a Dask cluster of this machine's processes, which listens to this machine alone."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

from ..interrupts import left_to_this_process
from . import logs

LOOPBACK = "127.0.0.1"
# Until a local process that was killed is given up: Dask starts it again, and takes more than the
# 15 s of its own on a machine that has much to do.
LOST = "30 days"


def local_cluster(count: int | None, threads: int | None) -> Any:
    """Start local processes; ``count`` and ``threads`` as ``Workers`` takes them.

    Notes
    -----
    Dask's dashboard is off. Its HTTP server still starts, on a free port, with no page.
    """
    import dask
    dask.config.set({"distributed.deploy.lost-worker-timeout": LOST})
    # A thread of its own makes the cluster: what it starts, now and for a worker that was killed,
    # leaves Ctrl-C to this process, while this thread goes on receiving it.
    with dask.config.set({
            # A pass may take minutes, in which a worker says nothing; and one cell most of the
            # memory, while the others wait for it.
            "distributed.scheduler.worker-ttl": None,
            "distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    ), ThreadPoolExecutor(1) as maker:
        making = maker.submit(_made, count, threads)
        try:
            return making.result()
        except BaseException:
            if making.exception() is None:      # interrupted: the cluster is there in a moment
                making.result().close()
            raise


def _made(count: int | None, threads: int | None) -> Any:
    import distributed
    with left_to_this_process():
        return distributed.LocalCluster(
            n_workers=count, threads_per_worker=1, processes=True, memory_limit=0, host=LOOPBACK,
            dashboard_address=None, silence_logs=logs.SILENT,
            scheduler_kwargs={"dashboard": False, "dashboard_address": f"{LOOPBACK}:0"},
            env={} if threads is None else {"LP_NUM_THREADS": str(threads)})
