"""In its own folders, the package refuses links, FIFOs and other users' files. Only the folder
GPGPU_RT_CACHE may be a link, and this link must lead to a folder of the user."""
from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
from conftest import random_soup

import gpgpu_rt as rt
from gpgpu_rt.accel import cache
from gpgpu_rt.accel.cache import cached
from gpgpu_rt.accel.sound import is_sound
from gpgpu_rt.cli import main
from gpgpu_rt.disk import own_folder
from gpgpu_rt.methods.bih.tree import build_bih
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.tree import Bvh
from gpgpu_rt.methods.grid.cells import build_grid
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.ray_engine.octree import build_octree
from gpgpu_rt.methods.ray_space.visibility_field import build_visibility_field
from gpgpu_rt.workers import machine, meshes

BUILDS = {build_bvh: ["sah", "kay-kajiya", "goldsmith-salmon", "lbvh", "hybrid"],
          build_kdtree: ["sah", "zhou", "hybrid"], build_bih: [None],
          build_grid: [None], build_octree: [None],
          build_visibility_field: [None]}
BUILT = [(build, kind) for build, kinds in BUILDS.items() for kind in kinds]


def built(build, kind: str | None, triangles: np.ndarray):
    """Returns a structure from the cache, or builds the structure."""
    return cached(build, triangles, **({} if kind is None else {"build": kind}))


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch) -> Path:
    """Makes tmp_path the folder for temporary files; returns its path."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.fixture
def another(monkeypatch) -> None:
    """Makes this process's files look like the files of another user, who is not root."""
    monkeypatch.setattr(own_folder, "_ROOT", -1)
    monkeypatch.setattr(os, "geteuid", lambda: 54321)


def test_a_link_in_place_of_the_unfinished_folder_is_refused(tmp_path: Path, capsys) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "00001.png").write_bytes(b"precious")
    (tmp_path / "x.gif.unfinished").symlink_to(tmp_path / "mine")
    status = main(["render", "cloth", "--frames", "1", "--size", "8", "-o",
                   str(tmp_path / "x.gif")])
    assert status == 1 and "x.gif.unfinished is a link" in capsys.readouterr().err
    assert (tmp_path / "mine" / "00001.png").read_bytes() == b"precious"


def test_an_unfinished_folder_of_another_user_is_refused(tmp_path: Path, another, capsys) -> None:
    (tmp_path / "x.gif.unfinished").mkdir()
    assert main(["render", "cloth", "--frames", "1", "--size", "8", "-o",
                 str(tmp_path / "x.gif")]) == 1
    assert "belongs to another user" in capsys.readouterr().err


@pytest.mark.parametrize("what", ["link", "file", "open to all", "fifo"])
def test_a_planted_folder_is_refused(what: str, temporary: Path) -> None:
    path = temporary / f"gpgpu_rt-{os.geteuid()}"
    if what == "link":
        (temporary / "theirs").mkdir()
        path.symlink_to(temporary / "theirs")
    elif what == "file":
        path.write_text("")
    elif what == "fifo":
        os.mkfifo(path)
    else:
        path.mkdir()
        path.chmod(0o777)
    with pytest.raises(rt.Error, match="TMPDIR"):
        own_folder.own_folder("meshes")
    with pytest.raises(rt.Error, match="TMPDIR"):
        meshes.take_mesh("cornell", {"cornell.ply": b"ply"})
    with pytest.raises(rt.Error, match="TMPDIR"), machine.taken():
        pass


def test_an_own_folder_is_for_this_user_alone(temporary: Path) -> None:
    for folder in (own_folder.own_folder(), own_folder.own_folder("meshes")):
        assert folder.is_dir() and folder.stat().st_mode & 0o077 == 0
    with machine.taken():
        assert [path.suffix for path in own_folder.own_folder().iterdir()
                if path.is_file()] == [".lock"]


@pytest.mark.parametrize("what", ["link", "folder", "fifo"])
def test_the_path_of_a_wrong_lock_file_is_named(what: str, temporary: Path) -> None:
    """A link, a folder or a FIFO in the place of the lock file is an error that gives the path."""
    path = machine._file()
    if what == "link":
        path.symlink_to(temporary / "elsewhere")
    elif what == "folder":
        path.mkdir()
    else:
        os.mkfifo(path)
    with pytest.raises(rt.Error, match=f"cannot lock {path}"), machine.taken():
        pass
    assert not (temporary / "elsewhere").exists()


# The cache --------------------------------------------------------------------------------------

def test_a_cache_of_another_user_is_not_used(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    triangles = random_soup(30, 1)
    cached(build_bvh, triangles)
    path, = tmp_path.glob("*.npz")
    monkeypatch.setattr(own_folder, "_ROOT", -1)
    monkeypatch.setattr(os, "geteuid", lambda: 54321)
    assert cache._load(path, Bvh, 30) is None
    cache._warn.cache_clear()
    with pytest.warns(UserWarning, match="belongs to another user"):
        assert cache.cache_folder() is None


def test_a_link_to_an_own_cache_is_followed(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "cache").symlink_to(tmp_path / "disk")
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "cache"))
    assert cache.cache_folder() == tmp_path / "cache"


def test_names_from_other_machines_stay_in_the_cache(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "cache"))
    cache.give_cache({"../outside.npz": b"x", "inside.npz": b"y"})
    assert [path.name for path in tmp_path.rglob("*.npz")] == ["inside.npz"]
    with pytest.raises(rt.Error, match="not the name of a mesh file"):
        meshes.take_mesh("cornell", {"../cornell.ply": b"ply"})


@pytest.mark.parametrize("build, kind", BUILT)
@pytest.mark.parametrize("count", [0, 1, 2, 300])
def test_built_structures_are_sound(build, kind: str | None, count: int, tmp_path: Path,
                                    monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    triangles = random_soup(count, 4) if count else np.zeros((0, 3, 3), np.float32)
    structure = built(build, kind, triangles)
    assert is_sound(structure, count)
    path, = tmp_path.glob("*.npz")
    assert cache._load(path, type(structure), count) is not None


HARM = {
    "cut": lambda a: a[:-1], "longer": lambda a: np.concatenate([a, a[-1:]]),
    "empty": lambda a: a[:0], "as text": lambda a: a.astype("U"), "scalar": lambda a: a[0],
    "one entry large": lambda a: np.where(np.arange(a.size).reshape(a.shape) == 1, 1 << 20,
                                          a).astype(a.dtype),
    "one entry below zero": lambda a: np.where(
        np.arange(a.size).reshape(a.shape) == 1, -9, a).astype(a.dtype)}


@pytest.mark.parametrize("harm", HARM)
@pytest.mark.parametrize("build, kind", [(b, k) for b, k in BUILT if k in ("sah", None)])
def test_structures_with_wrong_arrays_are_not_loaded(build, kind: str | None, harm: str,
                                                     tmp_path: Path, monkeypatch) -> None:
    """A structure with wrong indices, or with an array of a wrong shape or type, is not loaded. A
    checksum shows that a file is complete, but not that the file contains a valid tree."""
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    structure = built(build, kind, random_soup(40, 2))
    whole = {name: np.asarray(value) for name, value in vars(structure).items()}
    for name, value in whole.items():
        if value.ndim == 0 or "one entry" in harm and value.dtype.kind != "i":
            continue
        if harm == "one entry large" and value.dtype.itemsize == 1:
            continue
        arrays = {**whole, name: HARM[harm](value)}
        np.savez(tmp_path / "x.npz", **arrays, checksum=cache._checksum(arrays))
        assert cache._load(tmp_path / "x.npz", type(structure), 40) is None, name
        assert cache._load(tmp_path / "x.npz", type(structure), 39) is None, name


def test_a_tree_with_a_cycle_or_a_wrong_depth_is_unsound(tmp_path: Path, monkeypatch) -> None:
    """A kd-tree is unsound if a node's child is the root or a child of another node, or if the
    depth is wrong."""
    structure = build_kdtree(random_soup(40, 2))
    inner = np.flatnonzero(structure.axis != 3)
    for node, child in ((inner[1], 0), (inner[1], int(structure.left[inner[0]]))):
        left = structure.left.copy()
        left[node] = child
        assert not is_sound(type(structure)(**{**vars(structure), "left": left}), 40)
    for depth in (structure.depth + 1, structure.depth - 1, -1):
        assert not is_sound(type(structure)(**{**vars(structure), "depth": depth}), 40)
