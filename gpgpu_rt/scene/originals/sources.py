"""Sources: the files of the papers' scenes, and the repository that publishes each file.

``sources.csv`` pins each file to a commit and a SHA-256 digest. ``cameras.json`` holds the cameras
of the scenes.
"""
from __future__ import annotations

import csv
import functools
import importlib.resources
from dataclasses import dataclass
from pathlib import PurePosixPath
from urllib.parse import quote

_HOST = "https://raw.githubusercontent.com"
_PACKAGE = "gpgpu_rt.scene.originals"


@dataclass(frozen=True)
class SourceFile:
    """A file of a published scene.

    Attributes
    ----------
    scene : the name of the scene that needs the file
    repository : owner and name of the repository that publishes the file
    commit : the commit of the repository
    path : path of the file in the repository
    size : size in bytes
    sha256 : SHA-256 digest of the file, in hexadecimal
    terms : the terms of use, as the owner states them
    """

    scene: str
    repository: str
    commit: str
    path: str
    size: int
    sha256: str
    terms: str

    @property
    def place(self) -> PurePosixPath:
        """The file's path in a copy of the originals: REPOSITORY/PATH, without the owner."""
        return PurePosixPath(self.repository.partition("/")[2], self.path)

    def location(self, base: str | None) -> str:
        """Return the URL of the file, or its path in a folder.

        Parameters
        ----------
        base : URL or folder of a copy of the originals; None for the repository itself
        """
        if base is None:
            return f"{_HOST}/{self.repository}/{self.commit}/{quote(self.path)}"
        place = str(self.place)
        return f"{base.rstrip('/')}/{quote(place) if is_url(base) else place}"


def is_url(base: str) -> bool:
    """Return whether a text is a URL rather than a folder."""
    return "://" in base


@functools.cache
def source_files() -> dict[str, tuple[SourceFile, ...]]:
    """Return scene -> files, for each scene that can be fetched."""
    found: dict[str, list[SourceFile]] = {}
    text = (importlib.resources.files(_PACKAGE) / "sources.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        size = int(row.pop("bytes"))
        found.setdefault(row["scene"], []).append(SourceFile(size=size, **row))
    return {scene: tuple(files) for scene, files in sorted(found.items())}


def camera_text() -> str:
    """Return the JSON text with the cameras of fetched scenes. The teapot has no camera."""
    return (importlib.resources.files(_PACKAGE) / "cameras.json").read_text(encoding="utf-8")
