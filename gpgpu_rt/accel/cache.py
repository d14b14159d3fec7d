"""Cache: built accelerators on disk, found by the content of what they were built from.

The folder is $GPGPU_RT_CACHE, or ~/.cache/gpgpu_rt; an empty $GPGPU_RT_CACHE turns it off. A
file holds plain arrays and a checksum; one that does not read back whole is built again.
"""
from __future__ import annotations

import contextlib
import contextvars
import functools
import hashlib
import json
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeVar, cast, get_type_hints

import numpy as np

from ..disk.arrays import read_npz
from ..disk.own_folder import fault_of, is_own
from .bounds import as_triangles
from .sound import is_sound

Structure = TypeVar("Structure")

_keeping = contextvars.ContextVar("keeping", default=True)
_files: contextvars.ContextVar[list[Path] | None] = contextvars.ContextVar("files", default=None)


def cached(build: Callable[..., Structure], triangles: np.ndarray, /,
           **options: object) -> Structure:
    """`build(triangles, **options)`, from disk if it was built before.

    Parameters
    ----------
    build : a function that returns a dataclass of arrays and integers, and whose annotation says
        which; a change of its module's text, or of this folder's, makes it build anew
    triangles : (n, 3, 3) float32

    A folder that cannot be written only means that nothing is kept; one that was named is warned
    of, once.

    Raises
    ------
    TypeError
        a builder without the annotation
    """
    record = get_type_hints(build).get("return")
    if not is_dataclass(record):
        raise TypeError(f"annotate the dataclass that {build.__qualname__} returns: the cache "
                        "reads its files back as one")
    triangles = as_triangles(triangles)
    folder = cache_folder()
    if folder is None or not _keeping.get():
        return build(triangles, **options)
    path = folder / f"{_key(build, triangles, options)}.npz"
    if (files := _files.get()) is not None:
        files.append(path)
    structure: Structure | None = _load(path, record, len(triangles))
    if structure is None:
        structure = build(triangles, **options)
        _store(path, structure)
    return structure


@contextlib.contextmanager
def uncached() -> Iterator[None]:
    """Within it nothing is looked up or kept: for frames, each of which would fill the disk."""
    token = _keeping.set(False)
    try:
        yield
    finally:
        _keeping.reset(token)


@contextlib.contextmanager
def cache_files() -> Iterator[list[Path]]:
    """Within it, the list of the files that are looked up or kept: others may take them."""
    token = _files.set(files := [])
    try:
        yield files
    finally:
        _files.reset(token)


def give_cache(files: Mapping[str, bytes]) -> None:
    """Keep files of another machine's cache, by name, that are not here yet."""
    folder = cache_folder()
    for name, content in files.items():
        if folder is None:
            continue
        with _tolerated(folder):
            if Path(name).name == name and not (folder / name).exists():
                _write(folder / name, lambda file, content=content: file.write(content))


def cache_folder() -> Path | None:
    """Where accelerators are kept; None if they are not."""
    name = os.environ.get("GPGPU_RT_CACHE")
    if name == "":
        return None
    try:
        folder = Path(name).expanduser() if name else Path.home() / ".cache" / "gpgpu_rt"
    except RuntimeError as failure:     # no home folder, or not that user's
        _tell(name, str(failure))
        return None
    try:
        fault = fault_of(folder, follow=True)
    except (OSError, ValueError):       # not made yet, or never to be made: writing says so
        return folder
    if fault:
        _tell(str(folder), f"it {fault}")
        return None
    return folder


@contextlib.contextmanager
def _tolerated(folder: Path) -> Iterator[None]:
    """Within it, what cannot be written into the folder is not kept."""
    try:
        yield
    except OSError as failure:
        _tell(str(folder), failure.strerror or str(failure))


def _tell(folder: str | None, reason: str) -> None:
    """Warn of a folder that was named; the one that nobody chose is done without in silence."""
    if os.environ.get("GPGPU_RT_CACHE"):
        _warn(str(folder), reason)


@functools.cache        # once a process
def _warn(folder: str, reason: str) -> None:
    warnings.warn(f"GPGPU_RT_CACHE: nothing can be kept in {folder} ({reason}), and all is built "
                  "anew; name a folder that can be written", stacklevel=2)


def _key(build: Callable, triangles: np.ndarray, options: dict[str, object]) -> str:
    settings = json.dumps([_builders_digest(build.__module__), build.__module__,
                           build.__qualname__, options], sort_keys=True, default=_plain)
    digest = hashlib.sha256(settings.encode())
    digest.update(triangles)
    return digest.hexdigest()


@functools.cache
def _builders_digest(module: str) -> str:
    """Digest of the builders' own text, a module's and this folder's: a changed builder never
    finds an old file."""
    digest = hashlib.sha256()
    mine = getattr(sys.modules[module], "__file__", None) or __file__
    for path in (Path(mine), *sorted(Path(__file__).parent.glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _plain(value: object) -> object:
    return value.tolist() if hasattr(value, "tolist") else repr(value)


def _checksum(arrays: dict[str, np.ndarray]) -> np.ndarray:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        value = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {value.dtype.str} {value.shape};".encode())
        digest.update(value)
    return np.frombuffer(digest.digest(), np.uint8)


def _load(path: Path, record: type[Structure], triangles: int) -> Structure | None:
    """The structure of so many triangles, or None if there is no file of this user's, or not a
    whole one whose indices and lengths fit."""
    try:
        if not is_own(os.stat(path)):
            return None
        arrays = read_npz(path, "a structure")
        checksum = arrays.pop("checksum")
        if not np.array_equal(checksum, _checksum(arrays)):
            return None
        found = record(**{field.name: _scalar(arrays[field.name])
                          for field in fields(cast(Any, record))})
        return found if is_sound(found, triangles) else None
    except Exception:       # whatever a damaged file may raise, its zip or its headers
        return None


def _scalar(value: np.ndarray) -> np.ndarray | int:
    return value.item() if value.ndim == 0 else value


def _store(path: Path, structure: Any) -> None:
    """Write the file whole or not at all; two processes may do so at once."""
    arrays = {field.name: np.asarray(getattr(structure, field.name))
              for field in fields(structure)}
    arrays["checksum"] = _checksum(arrays)
    with _tolerated(path.parent):
        _write(path, lambda file: np.savez(file, **arrays))


def _write(path: Path, fill: Callable[[BinaryIO], object]) -> None:
    temporary = None
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=path.stem, suffix=".tmp",
                                         delete=False) as file:
            temporary = file.name
            fill(file)
        os.replace(temporary, path)
    except OSError:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
        raise
