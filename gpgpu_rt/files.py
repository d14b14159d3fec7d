"""Files: written whole or not at all, and archives of arrays read."""
from __future__ import annotations

import contextlib
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .errors import Error

WRITING = ".writing-"     # how the name of a file begins that is not whole yet


def check_writable(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there; asked before the work that fills it.

    Raises
    ------
    Error
        that says which folder is missing or closed.
    """
    path = Path(path)
    folder = path.parent
    if not folder.is_dir():
        raise Error(f"cannot write {path}: there is no folder {folder}; make it first")
    if path.is_dir():
        raise Error(f"cannot write {path}: it is a folder; give a file's name")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as failure:
        raise Error(f"cannot write {path}: {failure.strerror}; choose another folder") from failure
    return path


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place when the block ends well."""
    path = check_writable(path)
    handle, name = tempfile.mkstemp(prefix=WRITING, suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as failure:
        raise Error(f"cannot write {path}: {failure.strerror or failure}") from failure
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def read_npz(path: str | os.PathLike[str], what: str, kind: type[Error] = Error,
             ) -> dict[str, np.ndarray]:
    """The arrays of an .npz file, by name.

    Parameters
    ----------
    what : is to be read, for the message

    Raises
    ------
    kind
        a file that is not there, cannot be read, or is no archive of plain arrays
    """
    try:
        with np.load(path, allow_pickle=False) as file:    # TypeError: a single array's file
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, TypeError, AttributeError, RuntimeError,
            zipfile.BadZipFile, zlib.error) as failure:
        reason = ("no such file" if isinstance(failure, FileNotFoundError) else
                  getattr(failure, "strerror", None) or "not an .npz archive of plain arrays")
        raise kind(f"cannot read {what} from {path}: {reason}") from failure
