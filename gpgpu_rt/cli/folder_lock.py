"""Claim: a folder that one run at a time writes into."""
from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import IO

from ..disk.own_folder import fault_of, open_lock
from ..errors import Error

LOCK = "lock"     # the file in it that a run holds


class Claim:
    """Makes a folder and holds it, until ``release`` or the end of the process, however that ends.

    Parameters
    ----------
    folder : is made where it is missing
    purpose : what it is written for, for the message

    Raises
    ------
    Error
        where another run holds it, or it cannot be made or written into
    """

    def __init__(self, folder: Path, purpose: Path) -> None:
        self._path = folder / LOCK
        while True:
            try:
                folder.mkdir(exist_ok=True)
                fault = fault_of(folder, shared=True)
            except FileNotFoundError:
                if folder.parent.is_dir():
                    continue     # the run that had it took the folder away just now
                raise Error(f"cannot make the folder {folder}: there is no {folder.parent}"
                            ) from None
            except OSError as failure:
                raise Error(f"cannot make the folder {folder}: {failure.strerror}") from failure
            if fault:
                raise Error(f"{folder} {fault}, and what is unfinished is to be kept there; "
                            "remove it, or give another name")
            try:
                self._file = open_lock(self._path)
            except FileNotFoundError:
                continue     # the run that had it took the folder away just now
            if not _locked(self._file):
                self._file.close()
                raise Error(f"another run is writing {purpose}, and holds {folder}; wait until it "
                            "ends or stop it, or give another name")
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._file.fileno()), self._path.stat()):
                    return
            self._file.close()      # of a run that has let it go: who comes now has a new one

    def release(self) -> None:
        """Let others write there; again, it does nothing."""
        if not self._file.closed:
            self._path.unlink(missing_ok=True)
            self._file.close()


def _locked(file: IO[bytes]) -> bool:
    """Whether the file is this run's now, as far as its system has locks."""
    try:
        import fcntl
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        pass
    return True
