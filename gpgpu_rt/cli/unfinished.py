"""Unfinished output: keeps the finished parts of a film or picture, for a later run."""
from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from PIL import Image

from .. import __version__
from ..disk.budget import check_texels
from ..disk.files import WRITING, is_file, open_input, read_input, read_json, replacing
from ..errors import Error, LimitError, OptionError, SceneError
from .folder_lock import FolderLock
from .shared import say

RECORD = "parts.json"


def follows_from(method: str, options: Mapping[str, Any], renderer: str,
                 drawing: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that determine a part of an output: a film's frame or a picture's tile.

    The caller adds the scene's digest. ``options`` include the defaults; ``drawing`` holds the
    arguments of ``Tracer.render``.
    """
    return {**drawing, "method": method, "options": options, "renderer": renderer}


class Unfinished:
    """The finished parts of an output, in a folder that exists until the output is complete.

    Parameters
    ----------
    output : the file to write; the folder is ``OUTPUT.unfinished``
    count : the number of parts
    settings : the settings that determine a part, in types that JSON can hold
    resume : whether to keep the parts that an earlier run finished
    files : part number -> file, for parts that are themselves output, such as numbered frames;
        None keeps the parts in the folder

    Raises
    ------
    Error
        if the folder holds parts drawn with other settings, cannot be created, or is locked
    """

    def __init__(self, output: Path, count: int, settings: Mapping[str, Any], resume: bool,
                 files: Callable[[int], Path] | None = None) -> None:
        self.folder = output.with_name(output.name + ".unfinished")
        self._record = self.folder / RECORD
        self.file = files or (lambda part: self.folder / f"{part:05d}.png")
        self._settings = json.loads(json.dumps({
            **settings, "version": __version__}, default=str))
        self._done: dict[str, str] = {}
        self._lock = FolderLock(self.folder, output)
        try:
            if resume:
                self._take_on()
            else:
                self._clear()
            self.count = count
            self.missing = [part for part in range(count) if not self._is_there(part)]
            self._note()
        except BaseException:
            self._lock.release()
            raise

    def keep(self, part: int, image: Image.Image) -> None:
        """Write a part, and record that it is finished."""
        with replacing(self.file(part)) as path:
            image.save(path)
        self._done[str(part)] = _digest(self.file(part))
        self._note()

    def image(self, part: int) -> Image.Image:
        with open_input(self.file(part)) as file, Image.open(file) as image:
            check_texels(*image.size, str(self.file(part)))
            image.load()
            return image

    @contextlib.contextmanager
    def until_whole(self) -> Iterator[None]:
        """Return a context in which the caller makes the parts and assembles the output.

        The end of the context removes the folder. After an interrupt or an error, the folder stays
        if it has a finished part and a resumed run could succeed.
        """
        try:
            yield
        except (SceneError, OptionError, LimitError):
            self._remove()
            raise
        except BaseException:
            there = sum(map(self._is_there, range(self.count)))
            if there:
                say(f"{there} of {self.count} parts are saved; --resume draws the other parts")
            else:
                self._remove()
            raise
        else:
            self._remove()
        finally:
            self._lock.release()

    def _take_on(self) -> None:
        try:
            found = read_json(self._record)
            settings, done = dict(found["settings"]), dict(found["done"])
        except (OSError, ValueError, KeyError, TypeError):
            return      # no earlier run, or a damaged record: draw all parts
        others = [name for name in {**settings, **self._settings}
                  if settings.get(name) != self._settings.get(name)]
        if others:
            named = ", ".join(sorted(others))
            named = named if len(named) <= 120 else named[:117] + "..."
            raise Error(f"{self.folder} holds parts with another {named}; leave out --resume to "
                        "start again")
        self._done = done

    def _is_there(self, part: int) -> bool:
        file = self.file(part)
        return str(part) in self._done and is_file(file) and (
            _digest(file) == self._done[str(part)])

    def _note(self) -> None:
        with replacing(self._record) as path:
            path.write_text(json.dumps({"settings": self._settings, "done": self._done}))

    def _clear(self) -> None:
        with contextlib.suppress(OSError):
            for file in (*self.folder.glob("[0-9]*.png"), *self.folder.glob(WRITING + "*"),
                         self._record):
                file.unlink(missing_ok=True)

    def _remove(self) -> None:
        self._clear()
        self._lock.release()
        with contextlib.suppress(OSError):     # the folder stays if it holds foreign files
            self.folder.rmdir()


def _digest(file: Path) -> str:
    return hashlib.sha256(read_input(file)).hexdigest()
