"""The cache of built structures uses a file again only if builder, options and triangles match."""
from __future__ import annotations

import importlib
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from conftest import random_soup

from gpgpu_rt.accel import cache
from gpgpu_rt.accel.cache import cached
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.tree import Bvh
from gpgpu_rt.methods.grid.cells import Grid, build_grid
from gpgpu_rt.methods.kdtree.build import build_kdtree

STORE = """
import numpy as np
from gpgpu_rt.accel import cache
from gpgpu_rt.methods.bvh.build import build_bvh
triangles = np.random.default_rng(7).random((2000, 3, 3)).astype(np.float32)
for _ in range(15):
    cache._store(cache.cache_folder() / "same.npz", build_bvh(triangles))
"""

HEIGHTS = """
from dataclasses import dataclass
import numpy as np

calls = 0

@dataclass
class Heights:
    tops: np.ndarray

def build(triangles: np.ndarray) -> Heights:
    global calls
    calls += 1
    return Heights(triangles[:, :, 2].max(axis=1))
"""


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "new" / "cache"))
    return tmp_path / "new" / "cache"


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*"))


def test_an_option_may_be_called_build_or_triangles(folder: Path) -> None:
    """A builder's option may have the name of a parameter of `cached`."""
    triangles = random_soup(40, 1)
    for build in ("sah", "kay-kajiya"):
        bvh = cached(build_bvh, triangles, build=build)
        expected = build_bvh(triangles, build=build)
        assert np.array_equal(bvh.escape, expected.escape)
    assert len(files(folder)) == 2

    def build(given: np.ndarray, /, **options: int) -> Grid:
        return build_grid(given, resolution=options["triangles"])
    assert cached(build, triangles, triangles=3).resolution.tolist() == [3, 3, 3]


def test_a_structure_of_a_users_class_is_cached(folder: Path, monkeypatch, tmp_path) -> None:
    """`cached` stores and loads instances of a user's own class. A builder without a return
    annotation is an error."""
    (tmp_path / "heights.py").write_text(HEIGHTS)
    monkeypatch.syspath_prepend(tmp_path)
    heights = importlib.import_module("heights")
    triangles = random_soup(40, 5)
    for _ in range(2):
        assert np.array_equal(cached(heights.build, triangles).tops,
                              triangles[:, :, 2].max(axis=1))
    assert heights.calls == 1 and len(files(folder)) == 1
    with pytest.raises(TypeError, match="lambda.* a return annotation"):
        cached(lambda given: None, triangles)


def test_builder_options_triangles_and_text_all_make_another_file(folder, monkeypatch) -> None:
    """A new builder, option, triangle or source text makes a new file. A list in place of an equal
    array makes no new file."""
    triangles = random_soup(40, 2)
    nudged = triangles.copy()
    nudged[-1, -1, -1] = np.nextafter(nudged[-1, -1, -1], np.float32(9))
    cached(build_kdtree, triangles)
    cached(build_kdtree, nudged)
    cached(build_kdtree, triangles, bins=5)
    cached(build_kdtree, triangles, bins=6)
    cached(build_grid, triangles, resolution=np.array([2, 3, 4]))
    cached(build_grid, triangles, resolution=np.array([2, 3, 5]))
    assert len(files(folder)) == 6
    cached(build_grid, triangles, resolution=[2, 3, 5])
    assert len(files(folder)) == 6
    monkeypatch.setattr(cache, "_builders_digest", lambda module: "another text")
    cached(build_kdtree, triangles)
    assert len(files(folder)) == 7


def test_the_digest_follows_every_file_of_the_builders(tmp_path, monkeypatch) -> None:
    """A builder's digest depends on each Python file in the folder of cache.py, and on the file of
    the builder's module."""
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "cache.py"))
    digests = set()
    monkeypatch.setattr(sys.modules["pytest"], "__file__", str(tmp_path / "own" / "own.py"))
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "own.py").write_text("")
    for name, text in (("cache", "a"), ("sah", "a"), ("sah", "b"), ("own/own", "a")):
        (tmp_path / f"{name}.py").write_text(text)
        digests.add(cache._builders_digest.__wrapped__("pytest"))
    assert len(digests) == 4


@pytest.mark.parametrize("build", [build_grid, build_kdtree, build_bvh])
def test_fields_come_back_with_their_types(folder: Path, build) -> None:
    triangles = random_soup(30, 3)
    built = cached(build, triangles)
    read = cache._load(next(folder.glob("*.npz")), type(built), 30)
    assert type(read) is type(built)
    for name, value in vars(built).items():
        again = getattr(read, name)
        assert type(again) is type(value)
        if isinstance(value, np.ndarray):
            assert again.dtype == value.dtype and again.tobytes() == value.tobytes()


def test_one_changed_value_is_never_trusted(folder: Path) -> None:
    cached(build_bvh, random_soup(30, 4))
    path, = folder.glob("*.npz")
    with np.load(path) as file:
        arrays = dict(file)
    arrays["escape"][3] += 1
    np.savez(path, **arrays)            # a complete file with a wrong checksum
    assert cache._load(path, Bvh, 30) is None


def test_two_processes_may_store_at_once(folder: Path) -> None:
    environment = {**os.environ, "GPGPU_RT_CACHE": str(folder)}
    running = [subprocess.Popen([sys.executable, "-c", STORE], env=environment)
               for _ in range(2)]
    path, torn = folder / "same.npz", 0
    while any(process.poll() is None for process in running):
        torn += path.exists() and cache._load(path, Bvh, 2000) is None
    assert [process.returncode for process in running] == [0, 0]
    assert torn == 0 and files(folder) == ["same.npz"]


def test_a_chosen_folder_that_cannot_be_made_causes_a_warning(tmp_path, monkeypatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "file"))
    for seed in (5, 6):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            assert len(cached(build_bvh, random_soup(30, seed)).order) == 30
        assert [f"GPGPU_RT_CACHE: cannot use {tmp_path / 'file'}" in str(one.message)
                for one in told] == [True] * (seed == 5)     # only the first build warns


def test_a_default_folder_that_cannot_be_made_turns_the_cache_off(tmp_path, monkeypatch) -> None:
    """There is no warning, because the user did not choose the default folder."""
    (tmp_path / ".cache").write_text("in the way")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("GPGPU_RT_CACHE", raising=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cached(build_bvh, random_soup(30, 5))


def test_an_unknown_home_folder_causes_a_warning(monkeypatch) -> None:
    """If GPGPU_RT_CACHE names the home of an unknown user, the cache is off, and a warning
    contains the name."""
    monkeypatch.setenv("GPGPU_RT_CACHE", "~nobody-of-that-name/cache")
    with pytest.warns(UserWarning, match="nobody-of-that-name"):
        assert cache.cache_folder() is None


def test_a_failed_write_leaves_nothing(folder: Path, monkeypatch) -> None:
    def fill_up(file, **arrays):
        file.write(b"half")
        raise OSError(28, "No space left on device")
    monkeypatch.setattr(np, "savez", fill_up)
    with pytest.warns(UserWarning, match="No space left"):
        assert len(cached(build_bvh, random_soup(30, 6)).order) == 30
    assert files(folder) == []


def test_an_empty_folder_name_turns_the_cache_off(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", "")
    monkeypatch.chdir(tmp_path)
    cached(build_bvh, random_soup(30, 7))
    assert cache.cache_folder() is None and files(tmp_path) == []
