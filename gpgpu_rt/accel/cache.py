"""Cache: keeps built accelerators on disk, under a key made from the builder and its input.

The folder is $GPGPU_RT_CACHE, or ~/.cache/gpgpu_rt by default. An empty $GPGPU_RT_CACHE turns the
cache off. A file contains plain arrays and a checksum; a damaged file is ignored.
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
    """Return `build(triangles, **options)`, read from disk if possible.

    If the cache's folder cannot be written, the result is not kept. If GPGPU_RT_CACHE is set, this
    failure causes a warning, once per process.

    Parameters
    ----------
    build : a function that returns a dataclass of arrays and integers; its return annotation names
        the dataclass. Old files become invalid if the source text of the function's module or of
        a module of gpgpu_rt/accel changes
    triangles : (n, 3, 3) float32

    Raises
    ------
    TypeError
        the return annotation does not name a dataclass
    """
    record = get_type_hints(build).get("return")
    if not is_dataclass(record):
        raise TypeError(f"give {build.__qualname__} a return annotation that names a dataclass: "
                        "the cache makes this dataclass from a file")
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
    """Turn the cache off in this context, for example for the many frames of an animation."""
    token = _keeping.set(False)
    try:
        yield
    finally:
        _keeping.reset(token)


@contextlib.contextmanager
def cache_files() -> Iterator[list[Path]]:
    """Yield a list that receives the path of each cache file that is read or written in this
    context, for example to copy these files to another machine."""
    token = _files.set(files := [])
    try:
        yield files
    finally:
        _files.reset(token)


def give_cache(files: Mapping[str, bytes]) -> None:
    """Write another machine's cache files (name -> content), except files that exist here."""
    folder = cache_folder()
    for name, content in files.items():
        if folder is None:
            continue
        with _tolerated(folder):
            if Path(name).name == name and not (folder / name).exists():
                _write(folder / name, lambda file, content=content: file.write(content))


def cache_folder() -> Path | None:
    """Return the folder of the cache; None if the cache is off, the home folder is unknown, or the
    folder is not safe (`fault_of`)."""
    name = os.environ.get("GPGPU_RT_CACHE")
    if name == "":
        return None
    try:
        folder = Path(name).expanduser() if name else Path.home() / ".cache" / "gpgpu_rt"
    except RuntimeError as failure:     # the home folder of this user is not known
        _tell(name, str(failure))
        return None
    try:
        fault = fault_of(folder, follow=True)
    except (OSError, ValueError):   # the folder does not exist yet; a write makes it or fails
        return folder
    if fault:
        _tell(str(folder), f"it {fault}")
        return None
    return folder


@contextlib.contextmanager
def _tolerated(folder: Path) -> Iterator[None]:
    """Warn, instead of raising an error, if the body of ``with`` cannot write into the folder."""
    try:
        yield
    except OSError as failure:
        _tell(str(folder), failure.strerror or str(failure))


def _tell(folder: str | None, reason: str) -> None:
    """Warn that the folder cannot be used, unless it is the default folder."""
    if os.environ.get("GPGPU_RT_CACHE"):
        _warn(str(folder), reason)


@functools.cache        # warn once per process
def _warn(folder: str, reason: str) -> None:
    warnings.warn(f"GPGPU_RT_CACHE: cannot use {folder} ({reason}), so every accelerator is built "
                  "anew; name a folder that can be written", stacklevel=2)


def _key(build: Callable, triangles: np.ndarray, options: dict[str, object]) -> str:
    settings = json.dumps([_builders_digest(build.__module__), build.__module__,
                           build.__qualname__, options], sort_keys=True, default=_plain)
    digest = hashlib.sha256(settings.encode())
    digest.update(triangles)
    return digest.hexdigest()


@functools.cache
def _builders_digest(module: str) -> str:
    """Return a digest of the source text of a builder's module and of all modules in
    gpgpu_rt/accel, so that a changed builder reads no old file."""
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
    """Return the structure in a file; None if the file does not exist, belongs to another user or
    is damaged, or if its indices or lengths do not fit ``triangles`` triangles."""
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
    except Exception:       # a damaged zip file or header may raise any exception
        return None


def _scalar(value: np.ndarray) -> np.ndarray | int:
    return value.item() if value.ndim == 0 else value


def _store(path: Path, structure: Any) -> None:
    """Write the file of a structure completely or not at all, even if other processes write the
    same file."""
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
