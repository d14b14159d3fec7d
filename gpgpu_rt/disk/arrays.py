"""Arrays: .npy and .npz files, whose declared sizes are checked before they are read."""
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
# What a damaged archive raises in zipfile, zlib and NumPy.
DAMAGED = (OSError, ValueError, EOFError, TypeError, AttributeError, RuntimeError, KeyError,
           IndexError, OverflowError, SyntaxError, MemoryError, zipfile.BadZipFile, zlib.error)


def read_npz(path: str | os.PathLike[str], what: str, kind: type[Error] = Error,
             names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """The arrays of an .npz file, by name.

    Parameters
    ----------
    what : is to be read, for the message
    names : of the arrays that are of use, where the file may hold more

    Raises
    ------
    kind
        a file that is not there, cannot be read, or is no archive of plain arrays
    LimitError
        arrays that take more memory than the budget
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
    """The array of an .npy file.

    Raises
    ------
    OSError, ValueError
        a file that cannot be read, or is no array of plain values
    """
    with open_input(path) as file:
        return _array(file, os.fstat(file.fileno()).st_size)


def reason(failure: BaseException, what: str) -> str:
    """Why arrays cannot be read, in words."""
    if isinstance(failure, FileNotFoundError):
        return "no such file"
    if isinstance(failure, MemoryError):
        return "not enough memory for its arrays"
    return getattr(failure, "strerror", None) or f"not an {what} of plain arrays"


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    # Other compressions give back all of a block at once, however large.
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{info.filename}: a compression that NumPy does not write")
    with archive.open(info) as file:
        return _array(file, info.file_size)


def _array(file: BinaryIO | IO[bytes], size: int) -> np.ndarray:
    """The array of a file of ``size`` bytes, once its header declares no more than these."""
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"version {version} of NumPy's format is not read")
    try:
        shape, fortran, dtype = _HEADERS[version](file)
    except Exception as failure:    # whatever a damaged header may raise, a tokenizer's among it
        raise ValueError("its header cannot be read") from failure
    count = 1
    for length in shape:
        count *= int(length)
    if dtype.hasobject or min(shape, default=0) < 0 or not dtype.itemsize:
        raise ValueError("no array of plain values")
    if count * dtype.itemsize > size:
        raise ValueError(f"its header declares {count * dtype.itemsize} bytes of {size}")
    content = bytearray(count * dtype.itemsize)
    rest = memoryview(content)
    while rest:
        read = file.readinto(rest)      # type: ignore
        if not read:
            raise ValueError("it is cut")
        rest = rest[read:]
    return np.ndarray(shape, dtype, content, order="F" if fortran else "C")
