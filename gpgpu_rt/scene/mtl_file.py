"""MTL file: reads a library of Wavefront materials."""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..disk.files import decoded, read_input
from .material import Material
from .mesh_material import Textures, check_image, of_mtl

_IMAGES = ("map_kd", "map_ke")


@dataclass(frozen=True)
class LibraryMaterial:
    """A material of a library file.

    Attributes
    ----------
    path : the library's file
    name : the material's name
    said : key in lower case -> the words after the key; for ``map_kd`` and ``map_ke``, a list with
        only the whole file name
    """

    path: Path
    name: str
    said: dict[str, list[str]] = field(default_factory=dict)

    def material(self, textures: Textures) -> Material:
        """Return the material; raise SceneError if its texture cannot be read."""
        return of_mtl(self.name, self.said, textures)


def read_library(path: Path) -> dict[str, LibraryMaterial]:
    """Return the materials of a file by name. The file names after ``map_Kd`` and ``map_Ke`` may
    contain spaces.

    Raises
    ------
    OSError
        the file cannot be read
    SceneError, LimitError
        a texture cannot be read; a texture is too large
    """
    found: dict[str, LibraryMaterial] = {}
    current: LibraryMaterial | None = None
    for line in decoded(read_input(path)).splitlines():
        words = line.split()
        if len(words) < 2:
            continue
        key = words[0].lower()
        if key == "newmtl":
            current = found[" ".join(words[1:])] = LibraryMaterial(path, " ".join(words[1:]))
        elif current is not None:
            current.said[key] = words[1:]
            if key in _IMAGES:
                image = line.split(None, 1)[1].strip()
                check_image(path, path.parent / image)
                current.said[key] = [image]
    return found
