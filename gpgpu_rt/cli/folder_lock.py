"""Folder lock: lets only one run at a time write into a folder."""
from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import IO

from ..disk.own_folder import fault_of, open_lock
from ..errors import Error

LOCK = "lock"     # the file to lock in the folder


class FolderLock:
    """Locks a folder until ``release`` or the end of the process.

    Parameters
    ----------
    folder : the folder, created if it is missing
    purpose : the file or folder that the run writes; error messages name it

    Raises
    ------
    Error
        if another run has locked the folder, or the folder cannot be created or written
    """

    def __init__(self, folder: Path, purpose: Path) -> None:
        self._path = folder / LOCK
        while True:
            try:
                folder.mkdir(exist_ok=True)
                fault = fault_of(folder, shared=True)
            except FileNotFoundError:
                if folder.parent.is_dir():
                    continue     # another run has just removed the folder
                raise Error(f"cannot create the folder {folder}: there is no {folder.parent}"
                            ) from None
            except OSError as failure:
                raise Error(f"cannot create the folder {folder}: {failure.strerror}") from failure
            if fault:
                raise Error(f"{folder} {fault}, but the finished parts of {purpose} must be "
                            "kept there; remove it, or write to another place")
            try:
                self._file = open_lock(self._path)
            except FileNotFoundError:
                continue     # another run has just removed the folder
            if not _locked(self._file):
                self._file.close()
                raise Error(f"another run is writing {purpose} and has locked {folder}; wait for "
                            "its end, stop it, or write to another place")
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._file.fileno()), self._path.stat()):
                    return
            self._file.close()      # another run has removed this file: try a new file

    def release(self) -> None:
        """Remove and unlock the lock file. A second call does nothing."""
        if not self._file.closed:
            self._path.unlink(missing_ok=True)
            self._file.close()


def _locked(file: IO[bytes]) -> bool:
    """Lock the file. Return whether this succeeded; true on a system without file locks."""
    try:
        import fcntl
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        pass
    return True
