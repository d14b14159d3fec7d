"""Files: opens only regular files for reading, and writes a file completely or not at all."""
from __future__ import annotations

import contextlib
import errno
import json
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import Error

WRITING = ".writing-"     # prefix of unfinished files
_KINDS = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a FIFO", stat.S_IFCHR: "a device",
          stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket", stat.S_IFLNK: "a link"}
# Error numbers of a full disk, an exceeded quota, and a limit on file sizes.
FULL = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC))
_NO_OUTPUT = ("/dev", "/proc", "/sys")      # no place for a user's files


def open_input(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file for reading. A FIFO, which could block its reader for ever, is an error.

    Raises
    ------
    OSError
        if the file cannot be read; ``strerror`` says why
    """
    try:
        _check_regular(os.stat(path).st_mode, path)
        # O_NONBLOCK, because another process may replace the file by a FIFO before this line.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)
                         | getattr(os, "O_BINARY", 0))
    except ValueError as failure:       # the name contains a zero byte
        raise OSError(errno.EINVAL, "not a valid file name", os.fspath(path)) from failure
    except OSError as failure:
        if failure.errno in (errno.ENAMETOOLONG, errno.ENOTDIR):
            raise FileNotFoundError(errno.ENOENT, "no such file", os.fspath(path)) from failure
        raise
    try:
        _check_regular(os.fstat(handle).st_mode, path)
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def _check_regular(mode: int, path: str | os.PathLike[str]) -> None:
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, f"it is {kind_of(mode)}, not a regular file", os.fspath(path))


def kind_of(mode: int) -> str:
    """Return a name such as "a folder" for the ``st_mode`` of a file that is not regular."""
    return _KINDS.get(stat.S_IFMT(mode), "something else")


def is_file(path: str | os.PathLike[str]) -> bool:
    """Return whether the path is a regular file; False for an impossible name."""
    try:
        return os.path.isfile(path)
    except ValueError:
        return False


def read_input(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of a regular file; raise OSError as `open_input` does."""
    with open_input(path) as file:
        return file.read()


def read_json(path: str | os.PathLike[str]) -> Any:
    """Return the contents of a JSON file in UTF-8.

    Raises
    ------
    OSError
        as for `open_input`
    ValueError
        if the file is not UTF-8, not JSON, or nested too deeply
    """
    try:
        return json.loads(read_input(path).decode("utf-8-sig"))
    except UnicodeDecodeError as failure:
        raise ValueError(f"not UTF-8 at byte {failure.start}") from failure
    except RecursionError as failure:
        raise ValueError("brackets nested too deeply") from failure


def decoded(text: bytes) -> str:
    """Return text decoded as UTF-8, else as Latin-1, without a byte order mark."""
    try:
        return text.decode("utf-8-sig")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def check_writable(path: str | os.PathLike[str]) -> Path:
    """Return the path if a file can be written there.

    Raises
    ------
    Error
        if no file can be written; the message names the missing or read-only folder
    """
    named, path = os.fspath(path), Path(path)
    folder = path.parent
    if named.endswith("/"):
        raise Error(f"cannot write {named}: it names a folder; give a file's name")
    if not folder.is_dir():
        raise Error(f"cannot write {path}: there is no folder {folder}; create it first")
    if path.is_dir():
        raise Error(f"cannot write {path}: it is a folder; give a file's name")
    if path.exists() and not is_file(path):
        raise Error(f"cannot write {path}: it is {kind_of(path.stat().st_mode)}; give a file's "
                    "name")
    system = next((top for top in _NO_OUTPUT if folder.resolve().is_relative_to(top)), None)
    if system is not None and not folder.resolve().is_relative_to("/dev/shm"):
        raise Error(f"cannot write {path}: {system} belongs to the system; choose another folder")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as failure:
        raise Error(f"cannot write {path}: {failure.strerror}; choose another folder") from failure
    return path


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary file beside ``path``, which replaces ``path`` if the block succeeds."""
    path = check_writable(path)
    temporary = None
    try:
        handle, name = tempfile.mkstemp(prefix=WRITING, suffix=path.suffix, dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as failure:
        raise Error(f"cannot write {path}: {failure.strerror or failure}") from failure
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
