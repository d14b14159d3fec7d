"""Files: regular files alone are read, and written whole or not at all."""
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

WRITING = ".writing-"     # how the name of a file begins that is not whole yet
_KINDS = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a FIFO", stat.S_IFCHR: "a device",
          stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket", stat.S_IFLNK: "a link"}
# What writing to a full disk, or past a quota or a limit, fails with.
FULL = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC))
_NO_OUTPUT = ("/dev", "/proc", "/sys")      # folders that hold no files of a user


def open_input(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file, open to be read; a FIFO, which could make its reader wait for ever, is not
    opened.

    Raises
    ------
    OSError
        whose ``strerror`` says why the file cannot be read
    """
    try:
        _check_regular(os.stat(path).st_mode, path)
        # Another process may put a FIFO in the file's place just now.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)
                         | getattr(os, "O_BINARY", 0))
    except ValueError as failure:       # a zero byte in the name
        raise OSError(errno.EINVAL, "no name of a file", os.fspath(path)) from failure
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
    """What ``st_mode`` says of something that is no regular file."""
    return _KINDS.get(stat.S_IFMT(mode), "something else")


def is_file(path: str | os.PathLike[str]) -> bool:
    """Whether there is a regular file; unlike Path's, False for a name that no file can have."""
    try:
        return os.path.isfile(path)
    except ValueError:
        return False


def read_input(path: str | os.PathLike[str]) -> bytes:
    """The bytes of a regular file; OSError as `open_input`."""
    with open_input(path) as file:
        return file.read()


def read_json(path: str | os.PathLike[str]) -> Any:
    """What a JSON file in UTF-8 holds.

    Raises
    ------
    OSError
        as `open_input`
    ValueError
        a file that is not UTF-8, not JSON, or nested too deeply
    """
    try:
        return json.loads(read_input(path).decode("utf-8-sig"))
    except UnicodeDecodeError as failure:
        raise ValueError(f"not UTF-8 at byte {failure.start}") from failure
    except RecursionError as failure:
        raise ValueError("brackets nested too deeply") from failure


def decoded(text: bytes) -> str:
    """Text in UTF-8, or in Latin-1 where it is not UTF-8; a byte order mark is left out."""
    try:
        return text.decode("utf-8-sig")
    except UnicodeDecodeError:
        return text.decode("latin-1")


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
    if path.exists() and not is_file(path):
        raise Error(f"cannot write {path}: it is {kind_of(path.stat().st_mode)}; give a file's "
                    "name")
    system = next((top for top in _NO_OUTPUT if folder.resolve().is_relative_to(top)), None)
    if system is not None and not folder.resolve().is_relative_to("/dev/shm"):
        raise Error(f"cannot write {path}: {system} is the system's own; choose another folder")
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
