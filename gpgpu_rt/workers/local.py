"""Local cluster: a Dask cluster of processes on this machine. Other machines cannot reach it."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

from ..interrupts import left_to_this_process
from . import logs

LOOPBACK = "127.0.0.1"
# The time that Dask waits for a killed local process to restart. On a busy machine, the restart
# can take longer than Dask's default of 15 s.
LOST = "30 days"


def local_cluster(count: int | None, threads: int | None) -> Any:
    """Start local processes and return their Dask cluster.

    ``count`` and ``threads``: as for ``Workers``.

    Notes
    -----
    Dask's dashboard is off. Dask's HTTP server still starts on a free port, but serves no page.
    """
    import dask
    dask.config.set({"distributed.deploy.lost-worker-timeout": LOST})
    # Create the cluster in a thread that blocks Ctrl-C. The cluster's processes, also restarted
    # processes, inherit this block, and only the calling thread receives Ctrl-C.
    with dask.config.set({
            # A worker may be silent for minutes while it draws a pass.
            "distributed.scheduler.worker-ttl": None,
            "distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    ), ThreadPoolExecutor(1) as maker:
        making = maker.submit(_made, count, threads)
        try:
            return making.result()
        except BaseException:
            if making.exception() is None:      # interrupted: wait for the cluster and close it
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
