"""Own folder: makes this user's folder for temporary files, and checks whether to trust a folder.

All users share the folder for temporary files. Another user could create a link there, through
which this program would write its files, or a FIFO, which would block this program.
"""
from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import IO

from ..errors import Error
from .files import kind_of

_ROOT = 0


def own_folder(name: str = "") -> Path:
    """Return this user's own folder for temporary files; create it if missing.

    Parameters
    ----------
    name : a folder within the own folder

    Raises
    ------
    Error
        if the folder cannot be created or trusted (`fault_of`)
    """
    top = Path(tempfile.gettempdir()) / f"gpgpu_rt-{_user()}"
    for folder in (top, top / name) if name else (top,):
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
        except OSError as failure:
            raise Error(f"cannot create the folder {folder}: {failure.strerror}; remove what is "
                        "there, or name another folder for temporary files by TMPDIR") from failure
        fault = fault_of(folder)
        if fault:
            raise Error(f"{folder} {fault}; remove it, or name another folder for temporary files "
                        "by TMPDIR")
    return top / name


def fault_of(folder: Path, follow: bool = False, shared: bool = False) -> str | None:
    """Return why this user cannot trust the contents of a folder, or None.

    Parameters
    ----------
    folder : the folder
    follow : whether the folder may be a link; link and target must belong to this user or to root
    shared : whether other users may write into the folder
    """
    link = os.lstat(folder)
    if stat.S_ISLNK(link.st_mode) and not (follow and is_own(link)):
        return "is a link"
    there = os.stat(folder)
    if not stat.S_ISDIR(there.st_mode):
        return f"is {kind_of(there.st_mode)}, not a folder"
    if not is_own(there):
        return "belongs to another user"
    if not shared and hasattr(os, "geteuid") and there.st_mode & stat.S_IWOTH:
        return "can be written by all users"
    return None


def is_own(there: os.stat_result) -> bool:
    return not hasattr(os, "geteuid") or there.st_uid in (os.geteuid(), _ROOT)


def open_lock(path: Path) -> IO[bytes]:
    """Open a lock file; create it if missing; refuse a link or a FIFO.

    Raises
    ------
    FileNotFoundError
        if the folder is missing
    Error
        if the path is not a regular file, or cannot be opened
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"):
        flags |= getattr(os, name, 0)
    try:
        handle = os.open(path, flags, 0o600)
    except FileNotFoundError:
        raise
    except OSError as failure:
        raise Error(f"cannot lock {path}: {failure.strerror}; remove what is there") from failure
    mode = os.fstat(handle).st_mode
    if not stat.S_ISREG(mode):
        os.close(handle)
        raise Error(f"cannot lock {path}: it is {kind_of(mode)}, not a regular file; remove it")
    return os.fdopen(handle, "ab")


def _user() -> str:
    return str(os.geteuid()) if hasattr(os, "geteuid") else os.environ.get("USERNAME", "user")
