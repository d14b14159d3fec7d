"""A parallel build with any number of workers gives the same tree as a build in one process.

After a failure, no worker process and no shared memory remains.
"""
from __future__ import annotations

import dataclasses
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest
from conftest import assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt import threads
from gpgpu_rt.accel import shared_arrays as shared
from gpgpu_rt.accel.bounds import padding
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.kdtree import shevtsov
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.sah import Costs
from gpgpu_rt.methods.kdtree.sah_growth import Rules, root_level
from gpgpu_rt.rays.ray_sets import random_rays

SCRIPT = """
import numpy as np
from gpgpu_rt.methods.kdtree.build import build_kdtree
random = np.random.default_rng(1).random
triangles = (random((4000, 1, 3)) + 0.02 * random((4000, 3, 3))).astype(np.float32)
{guard}build_kdtree(triangles, workers=2)
"""

# The program FORKED hangs if a forked process waits for the threads of its parent's pool. NESTED
# hangs if the threads of a pool wait for each other. After 30 seconds, a signal ends the program.
FORKED = """
import os, signal, sys
import numpy as np
from gpgpu_rt.rays import batch as ray_batch
os.sched_getaffinity = lambda process: {0, 1}
ray_batch.AT_ONCE = 5000
rays = np.random.default_rng(1).random((2, 20_000, 3))
def laid_out():
    return b"".join(ray_batch.RayBatch(*rays).texels(k).tobytes() for k in range(2))
here = laid_out()
child = os.fork()
signal.alarm(30)
if not child:
    sys.exit(0 if laid_out() == here else 3)
print(os.waitpid(child, 0)[1], laid_out() == here)
"""
NESTED = """
import os, signal, threading
from gpgpu_rt.threads import threads
os.sched_getaffinity = lambda process: {0, 1}
signal.alarm(30)
run = threads(1 << 20)
def row(y):
    return sum(run(lambda x: 10 * y + x, range(3))), sum(threads(1 << 20)(abs, range(3)))
print(*run(row, range(6)), *{name.split("_")[0] for name in run(
    lambda part: threading.current_thread().name, range(2))})
"""


class Deadly(Rules):
    """Rules that end the process that unpickles them."""

    def __reduce__(self) -> tuple:
        return os._exit, (3,)


@pytest.fixture
def blocks(monkeypatch) -> list[str]:
    """Return a list that collects the names of all shared-memory blocks that are made."""
    names: list[str] = []

    def make(name: str | None = None, **more: object) -> SharedMemory:
        memory = SharedMemory(name, **more)
        names.append(memory.name)
        return memory
    monkeypatch.setattr(shared, "SharedMemory", make)
    return names


def processes() -> list[multiprocessing.Process]:
    """Return the child processes, without the workers that other tests share."""
    return [p for p in multiprocessing.active_children() if not p.name.startswith("Dask")]


def assert_nothing_left(blocks: list[str]) -> None:
    assert blocks and not processes()
    for name in blocks:
        with pytest.raises(FileNotFoundError):
            SharedMemory(name)


@pytest.mark.parametrize("seed, options, workers", [
    (41, {}, 2), (42, {"split": "exact", "clip": False}, 2),
    pytest.param(43, {"bins": 7, "max_depth": 9}, 5, marks=pytest.mark.full)],
    ids=["seed41-2", "seed42-exact-2", "seed43-5"])
def test_workers_build_the_same_tree(blocks, seed: int, options: dict, workers: int) -> None:
    triangles = random_soup(3000, seed, size=0.03)
    one = build_kdtree(triangles, **options)
    several = build_kdtree(triangles, workers=workers, **options)
    assert len(one.axis) > 900
    for field in dataclasses.fields(one):
        assert np.array_equal(getattr(one, field.name), getattr(several, field.name)), field.name
    assert_nothing_left(blocks)


@pytest.mark.parametrize("count", [0, 1, 9])
def test_workers_build_the_same_tree_of_few_triangles(count: int) -> None:
    triangles = random_soup(count, 44)
    one, several = (build_kdtree(triangles, workers=w) for w in (1, 3))
    assert np.array_equal(one.references, several.references)
    assert not processes()


def test_workers_build_beside_a_context(precise_renderer, tmp_path, monkeypatch) -> None:
    """Workers can build while an OpenGL context is open. The name of the cache file does not
    contain the number of workers."""
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    scene = soup_scene(2000, 45, size=0.05)
    rays = random_rays(scene, 500, 46)
    hits = []
    for workers in (2, 1):
        with rt.Tracer(scene, "kd-restart", workers=workers) as tracer:
            hits.append(tracer.trace(*rays))
    assert_same_bits(*hits)
    assert hits[0].hit.any() and len(list(tmp_path.glob("*.npz"))) == 1


def test_a_worker_that_dies_causes_an_error_of_one_line_and_leaves_nothing(blocks) -> None:
    triangles = random_soup(3000, 47, size=0.03)
    rules = Deadly(Costs(1, 2, 0.2), "binned", 8, 20, padding(triangles))
    with pytest.raises(rt.Error, match="workers=1") as failure:
        shevtsov.grow_on_processes(root_level(triangles, rules.pad), None, rules, 2)
    assert "\n" not in str(failure.value)
    assert_nothing_left(blocks)


def test_a_worker_s_own_error_comes_back_and_leaves_nothing(blocks, monkeypatch) -> None:
    triangles = random_soup(3000, 48, size=0.03)
    rules = Rules(Costs(1, 2, 0.2), "binned", 8, 20, padding(triangles))
    several = shevtsov.shared_arrays
    monkeypatch.setattr(shevtsov, "shared_arrays",
                        lambda box, **arrays: several(box=box[:3], **arrays))
    with pytest.raises(Exception, match="."):
        shevtsov.grow_on_processes(root_level(triangles, rules.pad), None, rules, 2)
    assert_nothing_left(blocks)


def test_full_shared_memory_is_a_limit_error(monkeypatch) -> None:
    def none(*arguments: object, **more: object) -> None:
        raise OSError(28, "No space left on device")
    monkeypatch.setattr(shared, "SharedMemory", none)
    with pytest.raises(rt.LimitError, match="workers=1"):
        build_kdtree(random_soup(3000, 49, size=0.03), workers=2)
    assert not processes()


@pytest.mark.full
@pytest.mark.parametrize("guard, right", [("", False), ("if __name__ == '__main__': ", True)],
                         ids=["unguarded", "guarded"])
def test_scripts(tmp_path, guard: str, right: bool) -> None:
    """A spawned worker imports the calling script, and this import must not start another build.

    A script without the guard `if __name__ == '__main__'` gets an error that names the guard.
    """
    script = tmp_path / "build.py"
    script.write_text(SCRIPT.format(guard=guard))
    answer = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                            timeout=600)
    assert (answer.returncode == 0) is right
    assert right or "if __name__ == '__main__'" in answer.stderr.splitlines()[-1]


@pytest.mark.parametrize("workers", [0, 1.5, "two", 257])
def test_wrong_numbers_of_workers_are_refused(workers) -> None:
    """`workers` must be a whole number from 1 to 256."""
    with pytest.raises(rt.OptionError, match="workers"):
        build_kdtree(random_soup(3, 50), workers=workers)


@pytest.mark.parametrize("seed", [3, 4], ids="seed{}".format)
@pytest.mark.parametrize("build, options", [
    (build_kdtree, {}), (build_kdtree, {"split": "exact"}), (build_bvh, {})])
def test_threads_build_the_same(build: Callable, options: dict, seed: int, monkeypatch) -> None:
    """The tree does not depend on which thread finishes first.

    The scene looks the same along all axes, so splits cost the same along all axes. With equal
    costs, the builder must split along the first axis.
    """
    random = np.random.default_rng(seed)
    some = (random.random((1000, 1, 3)) + 0.1 * random.random((1000, 3, 3))).astype(np.float32)
    triangles = np.concatenate([some, some[..., [1, 2, 0]], some[..., [2, 0, 1]]])
    used: list[object] = []

    class Pool(ThreadPoolExecutor):
        def map(self, function: Callable, parts: Iterable) -> list:
            used.append(function)
            waiting = [self.submit(late, random.random() / 2000, function, part)
                       for part in parts]
            return [one.result() for one in waiting]

    def late(seconds: float, function: Callable, part: object) -> object:
        time.sleep(seconds)
        return function(part)

    monkeypatch.setattr(threads, "_pool", Pool)
    monkeypatch.setattr(threads, "WORTH", 4000)
    alone = build(triangles, **options)
    assert not used
    monkeypatch.setattr(threads, "WORTH", 3000)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1, 2}, raising=False)
    shared_out = build(triangles, **options)
    assert used
    for name, values in vars(alone).items():
        assert np.array_equal(values, getattr(shared_out, name)), name


@pytest.mark.parametrize("code, said", [
    (FORKED, "0 True"),
    (NESTED, " ".join(map(str, [*((30 * y + 3, 3) for y in range(6)), "ThreadPoolExecutor-0"])))],
    ids=["after a fork", "nested"])
def test_threads_do_not_wait_for_each_other(code: str, said: str) -> None:
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.strip() == said
