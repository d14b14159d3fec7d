"""Arrays: read .npy and .npz files, after a check of the sizes that their headers declare."""
from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Collection
from typing import IO, BinaryIO

import numpy as np

from ..errors import Error
from .budget import check_bytes
from .files import open_input

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0}
# Errors of zipfile, zlib and NumPy for a damaged archive.
DAMAGED = (OSError, ValueError, EOFError, TypeError, AttributeError, RuntimeError, KeyError,
           IndexError, OverflowError, SyntaxError, MemoryError, zipfile.BadZipFile, zlib.error)


def read_npz(path: str | os.PathLike[str], what: str, kind: type[Error] = Error,
             names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of an .npz file: name -> array.

    Parameters
    ----------
    path : the file
    what : the contents of the file, for error messages
    kind : the class of the error to raise
    names : the arrays to read; None for all

    Raises
    ------
    kind
        if the file is missing, cannot be read, or is not an archive of plain arrays
    LimitError
        if the arrays need more memory than the budget
    """
    try:
        with open_input(path) as file, zipfile.ZipFile(file) as archive:
            stored = os.fstat(file.fileno()).st_size
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            wanted = {name: info for name, info in members.items()
                      if names is None or name in names}
            check_bytes(sum(info.file_size for info in wanted.values()), stored, str(path))
            return {name: _member(archive, info) for name, info in wanted.items()}
    except DAMAGED as failure:
        raise kind(f"cannot read {what} from {path}: {reason(failure, '.npz archive')}"
                   ) from failure


def read_npy(path: str | os.PathLike[str]) -> np.ndarray:
    """Return the array of an .npy file.

    Raises
    ------
    OSError, ValueError
        if the file cannot be read, or is not an array of plain values
    """
    with open_input(path) as file:
        return _array(file, os.fstat(file.fileno()).st_size)


def reason(failure: BaseException, what: str) -> str:
    if isinstance(failure, FileNotFoundError):
        return "no such file"
    if isinstance(failure, MemoryError):
        return "not enough memory for its arrays"
    return getattr(failure, "strerror", None) or f"not an {what} of plain arrays"


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    # Other compressions decode a whole block at once, and a block's decoded size has no limit.
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{info.filename}: a compression that NumPy does not write")
    with archive.open(info) as file:
        return _array(file, info.file_size)


def _array(file: BinaryIO | IO[bytes], size: int) -> np.ndarray:
    """Return a file's array; raise ValueError if its header declares more than ``size`` bytes."""
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"version {version} of NumPy's format is not read")
    try:
        shape, fortran, dtype = _HEADERS[version](file)
    except Exception as failure:    # numpy's parser may raise any exception
        raise ValueError("its header cannot be read") from failure
    count = 1
    for length in shape:
        count *= int(length)
    if dtype.hasobject or min(shape, default=0) < 0 or not dtype.itemsize:
        raise ValueError("not an array of plain values")
    if count * dtype.itemsize > size:
        raise ValueError(f"its header declares {count * dtype.itemsize} bytes, but the "
                         f"file has {size}")
    content = bytearray(count * dtype.itemsize)
    rest = memoryview(content)
    while rest:
        read = file.readinto(rest)      # type: ignore
        if not read:
            raise ValueError("the file is truncated")
        rest = rest[read:]
    return np.ndarray(shape, dtype, content, order="F" if fortran else "C")
