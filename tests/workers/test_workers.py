"""Workers find the same hits as a single process, even after the loss of a worker."""
from __future__ import annotations

import fcntl
import logging
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.accel.cache import cache_files, give_cache
from gpgpu_rt.rays import ray_sets as rays
from gpgpu_rt.workers import Workers, logs, machine, tasks

pytest.importorskip("distributed")

from gpgpu_rt.workers import workers as module  # noqa: E402

METHOD, OPTIONS = "bvh-threaded", {"octants": True}


def _killed_once(flag: str, number: int) -> int:
    """Returns the square of ``number``, but kills the worker when task 1 runs for the first
    time."""
    if number == 1 and not os.path.exists(flag):
        open(flag, "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def test_hits_equal_the_hits_of_one_process(workers: Workers, monkeypatch) -> None:
    monkeypatch.setattr(module, "PART", 256)
    scene = rt.load_scene("cornell")
    origins, directions = rays.random_rays(scene, 2000, 5)
    t_max = np.linspace(0.1, 3, 2000, dtype=np.float32)
    told: list[tuple[int, int]] = []
    found = workers.trace(scene, origins, directions, METHOD, t_max=t_max, statistics=True,
                          progress=lambda *at: told.append(at), **OPTIONS)
    hidden = workers.occluded(scene, origins, directions, METHOD, t_max=t_max, **OPTIONS)
    with rt.Tracer(scene, METHOD, statistics=True, **OPTIONS) as tracer:
        alone = tracer.trace(origins, directions, t_max=t_max)
    assert told[-1] == (7, 7)
    assert set(found.to_dict()) == set(alone.to_dict()) and found.hit.any()
    for name, values in alone.to_dict().items():
        assert (found.to_dict()[name] == values).all(), name
    assert (hidden == alone.hit).all()


@pytest.mark.parametrize("given", ["image", "shape"])
def test_packets_find_the_same_tiles(given: str, workers: Workers, monkeypatch) -> None:
    """Packets of workers hold the same rays as packets of a single process, so their counters are
    equal. If workers cut the image into rows of another width, the counters would differ."""
    monkeypatch.setattr(module, "PART", 256)
    scene = rt.load_scene("cornell")
    origins, directions = scene.camera.rays((44, 37))  # 37 rows of 44
    t_min = np.linspace(0, 900, 44 * 37).reshape(37, 44)
    t_max = np.linspace(500, 2000, 44 * 37).reshape(37, 44)
    rays_of, more = (origins, directions), {}
    if given == "shape":
        rays_of, more = (origins.reshape(-1, 3), directions.reshape(-1, 3)), {"shape": (37, 44)}
    told: list[tuple[int, int]] = []
    options = {"packet": (4, 2), "statistics": True}
    found = workers.trace(scene, *rays_of, "bvh-packet", t_min, t_max, **more, **options,
                          progress=lambda *at: told.append(at))
    hidden = workers.occluded(scene, *rays_of, "bvh-packet", t_max, t_min, **more)
    with rt.Tracer(scene, "bvh-packet", **options) as tracer:
        alone = tracer.trace(origins, directions, t_min, t_max)
    assert told[-1] == (4, 4)
    for name, values in alone.to_dict().items():
        assert (found.to_dict()[name] == values).all(), name
    assert (hidden == alone.hit).all() and 0 < hidden.sum() < len(hidden)


@pytest.mark.parametrize("shape", [(0, 5), (1, 1), (7, 3), (16, 2)])
def test_images_of_few_rows(shape: tuple[int, int], workers: Workers,
                            monkeypatch) -> None:
    """Images of any small size are traced. A shape that does not match the rays is refused."""
    monkeypatch.setattr(module, "PART", 1)
    directions = np.ones((*shape, 3), np.float32)
    found = workers.trace("cornell", 0 * directions, directions, METHOD)
    assert len(found) == shape[0] * shape[1]
    with pytest.raises(ValueError, match="does not hold"):
        workers.trace("cornell", 0 * directions, directions, METHOD, shape=(3, 11))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("t_max", [1e300, np.full(3, 1e300)], ids=["one", "one per ray"])
def test_a_t_max_beyond_float32_is_infinite(t_max, workers: Workers) -> None:
    """A t_max beyond float32's range means no end."""
    rays_of = np.zeros((3, 3)), np.ones((3, 3))
    assert (workers.trace("cornell", *rays_of, METHOD, t_max=t_max).t
            == workers.trace("cornell", *rays_of, METHOD).t).all()


def test_a_killed_worker_loses_nothing(workers: Workers, tmp_path) -> None:
    flag = str(tmp_path / "killed")
    found = dict(workers.map(_killed_once, [(flag, number) for number in range(6)]))
    assert found == {number: number * number for number in range(6)}
    assert os.path.exists(flag)
    # The worker that replaces the killed worker gets the scene again.
    scene = rt.load_scene("cornell")
    origins, directions = rays.random_rays(scene, 100, 6)
    with rt.Tracer(scene, METHOD, **OPTIONS) as tracer:
        alone = tracer.trace(origins, directions)
    assert (workers.trace(scene, origins, directions, METHOD, **OPTIONS).t == alone.t).all()


def test_errors_of_tasks_are_the_users_own(workers: Workers) -> None:
    with pytest.raises(rt.OptionError, match="octant"):
        workers.trace("cornell", np.zeros((1, 3)), np.ones((1, 3)), METHOD, octant=True)


def test_a_worker_starts_no_processes(workers: Workers) -> None:
    with pytest.raises(rt.OptionError, match="leave the option workers at 1"):
        workers.trace("cornell", np.zeros((1, 3)), np.ones((1, 3)), "kd-restart", workers=2)


def test_an_invalid_ray_is_named_as_it_was_given(workers: Workers, monkeypatch) -> None:
    monkeypatch.setattr(module, "PART", 2)
    origins = np.zeros((9, 3), np.float32)
    origins[7, 1] = np.nan
    with pytest.raises(ValueError, match="ray 7 is invalid"):
        workers.trace("cornell", origins, np.ones((9, 3)), METHOD)
    found = workers.trace("cornell", origins, np.ones((9, 3)), METHOD, invalid="miss")
    assert found.status.tolist() == [0] * 7 + [1, 0]


def test_trace_command(tmp_path, capsys, address: str) -> None:
    scene = rt.load_scene("cornell")
    origins, directions = scene.camera.rays((8, 8))
    given, written = tmp_path / "rays.npz", tmp_path / "hits.npz"
    np.savez(given, origins=origins, directions=directions)
    words = ["trace", "cornell", str(given), "-o", str(written), "--scheduler"]
    assert cli.main([*words, address]) == 0
    assert re.search("rays hit, traced by (1 worker|2 workers);", capsys.readouterr().out)
    with rt.Tracer(scene) as tracer:
        assert (np.load(written)["t"] == tracer.trace(origins, directions).t).all()
    assert cli.main([*words, "local", "-m", "auto"]) == 1
    assert "with --scheduler, name the method" in capsys.readouterr().err


def test_arrays_that_do_not_fit_are_refused(workers: Workers) -> None:
    with pytest.raises(ValueError):
        workers.trace("cornell", np.zeros((4, 6)), np.ones((8, 3)), METHOD)


def test_old_scenes_are_released_and_options_may_be_lists(workers: Workers, monkeypatch) -> None:
    """Only the latest MOST_KEPT scenes and structures are kept."""
    monkeypatch.setattr(module, "MOST_KEPT", 3)
    rays_of = np.zeros((1, 3)), np.ones((1, 3))
    for size in (1.0, 2.0, 3.0):
        scene = rt.Scene.from_arrays(size * np.eye(3), [[0, 1, 2]])
        found = workers.trace(scene, *rays_of, "bvh-packet", packet=[2, 2])
        assert found.t[0] == pytest.approx(size / 3)
    assert len(workers._futures) == 3


def test_structures_travel_as_files_of_the_cache(tmp_path, monkeypatch) -> None:
    """A worker with the client's cache files does not build a structure again."""
    scene = rt.load_scene("cornell")
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "here"))
    built = tasks.structures(scene, "digest a", "kd-restart", ())
    assert built and all(name.endswith(".npz") for name in built)
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "there"))
    give_cache(built)
    with cache_files() as files, rt.Tracer(scene, "kd-restart"):
        assert [file.name for file in files] == list(built)
    assert {file.name: file.read_bytes() for file in (tmp_path / "there").iterdir()} == built


@pytest.mark.parametrize("arguments, message", [
    (dict(scheduler="tcp://127.0.0.1:1"), "no Dask scheduler answers"),
    (dict(scheduler="nonsense"), "no Dask scheduler answers at nonsense .missing port"),
    (dict(scheduler=2), "scheduler is 2; give local"),
    (dict(count=0), "count is 0; give a whole number of 1 or more"),
    (dict(count=1.5), "count is 1.5; give a whole"), (dict(count="two"), "count is 'two'; give"),
    (dict(count=1, threads="2"), "threads is '2'; give")])
def test_mistakes_are_one_line(arguments: dict, message: str, monkeypatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", "0.5s")
    with pytest.raises(rt.Error, match=message):
        Workers(**arguments)


def test_a_scheduler_without_workers(monkeypatch) -> None:
    import distributed
    monkeypatch.setattr(module, "PATIENCE", "5s")
    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster:
        with pytest.raises(rt.Error, match="has no workers; start some"):
            Workers(cluster.scheduler_address)


def test_workers_that_would_be_forked_are_refused() -> None:
    import dask
    with dask.config.set({"distributed.worker.multiprocessing-method": "fork"}):
        with pytest.raises(rt.Error, match="METHOD=spawn"):
            Workers()


def _dies(flag: str) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _lacks(flag: str) -> None:
    raise ModuleNotFoundError("No module named 'figment'")


@pytest.mark.parametrize("task, message", [(_dies, "died repeatedly"),
                                           (_lacks, "lack a module that a part needs .*figment")])
def test_errors_of_dask_give_one_line(task, message: str, workers: Workers) -> None:
    """A worker that dies or lacks a module gives an error of one line."""
    with pytest.raises(rt.Error, match=message):
        list(workers.map(task, [("",)]))


def test_without_dask_the_error_says_what_to_install() -> None:
    code = ("import sys; sys.modules['distributed'] = None\n"
            "from gpgpu_rt.workers import Workers\n"
            "try: Workers()\n"
            "except Exception as failure: print(failure)")
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "pip install -e '.[workers]'" in answer.stdout


def test_misuse_is_an_error_with_advice(workers: Workers) -> None:
    with pytest.raises(rt.OptionError, match="threads is 0"):
        Workers(count=1, threads=0)
    with pytest.raises(rt.OptionError, match="auto is not a method"):
        workers.trace("cornell", np.zeros((1, 3)), np.ones((1, 3)), "auto")
    closed = Workers(workers.client.scheduler.address)
    closed.close()
    with pytest.raises(rt.Error, match="were closed"):
        closed.trace("cornell", np.zeros((1, 3)), np.ones((1, 3)), METHOD)
    with pytest.raises(rt.OptionError, match="not 'kd-restart'"):
        rt.Choices(rt.Choice("grid"), "kd-restart")
    (frame, pixels), = workers.frames("cloth", [3], METHOD, drawing={"size": (8, 6)})
    assert frame == 3 and pixels.shape == (6, 8, 3)


def test_who_waits_for_the_machine_says_so(tmp_path, monkeypatch) -> None:
    """A process that holds the machine's shared lock may ask for the exclusive lock. If the
    process must wait for another holder of the shared lock, `taken` calls its argument."""
    monkeypatch.setattr(machine, "_file", lambda: tmp_path / "lock")
    waited: list[str] = []
    with (tmp_path / "lock").open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_SH)

        def told() -> None:
            waited.append("told")
            fcntl.flock(other, fcntl.LOCK_UN)
        with machine.taken(told):
            assert not waited
            with machine.alone():
                assert waited == ["told"]


def test_the_last_silenced_block_restores_dasks_logger() -> None:
    logger, handler = logging.getLogger("distributed"), logging.StreamHandler()
    handler.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        first, second = logs.silenced(), logs.silenced()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert handler.level == logs.SILENT
        second.__exit__(None, None, None)
        assert handler.level == logging.INFO
    finally:
        logger.removeHandler(handler)


def _listening(processes: list[int]) -> set[str]:
    """Returns the addresses at which these processes and their children accept connections."""
    import psutil
    whole = [child for number in processes for child in (
        psutil.Process(number), *psutil.Process(number).children(recursive=True))]
    return {one.laddr.ip for process in whole for one in process.net_connections("inet")
            if one.status == psutil.CONN_LISTEN}


def test_local_workers_listen_to_this_machine_alone(workers: Workers) -> None:
    found = _listening([os.getpid(), *workers.processes()])
    assert found == {"127.0.0.1"}


def test_tls_without_a_certificate_gives_one_line() -> None:
    """TLS without a certificate gives an error of one line. In the past, Dask raised a TypeError,
    and deleting the client took 20 s."""
    with pytest.raises(rt.Error, match="certificate"):
        Workers("tls://127.0.0.1:1")


def test_local_workers_show_no_dashboard(workers: Workers) -> None:
    import urllib.error
    import urllib.request
    port = workers.client.scheduler_info()["services"].get("dashboard")
    for page in ("status", "info/main/workers.html", "metrics", "") if port else ():
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(f"http://127.0.0.1:{port}/{page}")
