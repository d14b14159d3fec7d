"""MTL file: a library of Wavefront's materials, as words by their keys."""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..disk.files import decoded, read_input
from .material import Material
from .mesh_material import Textures, check_image, of_mtl

_IMAGES = ("map_kd", "map_ke")


@dataclass(frozen=True)
class Library:
    """What a library says of a material.

    Attributes
    ----------
    path : the library
    name : the material's
    said : words after each key, in small letters; those of a texture are its file's name
    """

    path: Path
    name: str
    said: dict[str, list[str]] = field(default_factory=dict)

    def material(self, textures: Textures) -> Material:
        """The material; SceneError for a texture that cannot be read."""
        return of_mtl(self.name, self.said, textures)


def read_library(path: Path) -> dict[str, Library]:
    """The materials of a file, by name.

    Raises
    ------
    OSError
        a file that cannot be read
    SceneError
        a texture that cannot be read; the rest of a line names it, as files with spaces need
    """
    found: dict[str, Library] = {}
    current: Library | None = None
    for line in decoded(read_input(path)).splitlines():
        words = line.split()
        if len(words) < 2:
            continue
        key = words[0].lower()
        if key == "newmtl":
            current = found[" ".join(words[1:])] = Library(path, " ".join(words[1:]))
        elif current is not None:
            current.said[key] = words[1:]
            if key in _IMAGES:
                image = line.split(None, 1)[1].strip()
                check_image(path, path.parent / image)
                current.said[key] = [image]
    return found
