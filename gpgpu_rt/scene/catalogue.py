"""Catalogue: the named scenes, the folders of their meshes, and their procedural versions."""
from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PurePath

import numpy as np
import platformdirs

from ..errors import SceneError, nearest_name
from .camera import Camera, load_cameras
from .mesh_file import SUFFIXES
from .procedural import animations as animation
from .procedural import buildings, cornell, creatures, images, lit, outdoors, rooms, walker
from .procedural.built import Built
from .procedural.painting import by_part, cornell_walls

Paint = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class NamedScene:
    """A scene that users load by its name.

    Attributes
    ----------
    name : The scene's name.
    triangles : Number of triangles of the procedural version, or of ``file`` if ``make`` is None.
    make : Function that builds the procedural version; None if there is none.
    stand_in : The name of the original that the procedural version replaces. None if there is no
        procedural version, or if the procedural version is itself the original.
    original : The source of the original, or "not available". For a scene without an original,
        a description of the scene.
    page : A hint for an original that cannot be fetched: the owner's page, if any, and the file
        name for a user's own mesh. None for other scenes.
    light : Position of the light for the scene's mesh; None for a light beside the camera.
    paint : Function that makes colours, (n, 3), for a mesh without colours.
    takes_argument : Whether ``make`` has an argument, as in ``stadium:1e-3``.
    file : The path of the scene's file in a folder of meshes. None if the file is NAME.ply,
        NAME.obj or the like.
    """

    name: str
    triangles: int
    make: Callable[..., Built] | None
    stand_in: str | None
    original: str
    light: tuple[float, float, float] | None = None
    paint: Paint | None = None
    takes_argument: bool = False
    page: str | None = None
    file: str | None = None


PUBLISHED = "originals"     # subfolder with the published files that animations read
_BART = "BART (Lext, Assarsson, Moeller), Chalmers: "
_BART_FILES = f"{PUBLISHED}/BART-Animations/"

ROWS: dict[str, NamedScene] = {row.name: row for row in (
    NamedScene("cornell", 32, cornell.make, None,
               "built in from Cornell University's published data",
               (0.0, 1.9, 0.0), cornell_walls),
    NamedScene("bunny", 69_451, creatures.bunny, "the Stanford bunny",
               "Stanford 3D Scanning Repository: bun_zipper.ply"),
    NamedScene("robots", 71_708, outdoors.robots, "BART's robots",
               _BART + "the robots scene at t = 0",
               (-1.0, 6.0, -200.0), by_part),
    NamedScene("kitchen", 110_561, rooms.kitchen, "BART's kitchen",
               _BART + "the kitchen scene at t = 0",
               (3.1, 2.1, 3.3), by_part),
    NamedScene("robots-moving", 71_708, None, None, _BART + "the robots scene, frame by frame",
               file=_BART_FILES + "scene_robot/aff/Robot.aff"),
    NamedScene("kitchen-moving", 110_561, None, None, _BART + "the kitchen scene, frame by frame",
               file=_BART_FILES + "scene_kitchen/aff/kitchen.aff"),
    NamedScene("cows", 23_218, creatures.cows, "Thrane and Simonsen's Cows, whose triangle count "
               "and arrangement are not published", "not available",
               page="the arrangement was never published; a mesh of your own must be named "
               "cows.ply"),
    NamedScene("conference", 282_641, rooms.conference, "the conference room",
               "McGuire Computer Graphics Archive: Conference Room (331,179 triangles; the "
               "papers in the survey use editions of 274,000 to 282,801)",
               (300.0, 560.0, -250.0), by_part),
    NamedScene("fairyforest", 174_117, outdoors.fairyforest, "the Utah fairy forest",
               "Utah 3D Animation Repository: Fairy Forest",
               page="https://www.sci.utah.edu/~wald/animrep/ publishes the fairy forest; save "
               "one of its frames as fairyforest.obj, with its .mtl file in the same folder"),
    NamedScene("sodahall", buildings.SODA_HALL, buildings.sodahall, "Soda Hall",
               "UC Berkeley's Walkthru group: Soda Hall",
               page="https://people.eecs.berkeley.edu/~sequin/soda/soda.html leads to its models; "
               "save a model, converted to triangles, as sodahall.ply"),
    NamedScene("powerplant", buildings.POWER_PLANT, buildings.powerplant, "the Power Plant",
               "UNC Chapel Hill's GAMMA group: Power Plant",
               page="http://gamma.cs.unc.edu/POWERPLANT/ publishes the power plant in sections; "
               "join the sections and save them as powerplant.ply"),
    NamedScene("shirley6", 804, rooms.shirley6, "Shirley's scene 6", "not available",
               page="its model was never published; a mesh of your own must be named "
               "shirley6.ply"),
    NamedScene("buddha", 100_000, creatures.buddha, "the Buddha of the survey's Figure 1, here "
               "with a tenth of the original's 1,087,716 triangles",
               "Stanford 3D Scanning Repository: Happy Buddha",
               page="http://graphics.stanford.edu/data/3Dscanrep/ publishes the Happy Buddha; "
               "save its happy_vrip.ply as buddha.ply"),
    NamedScene("tenk", 10_000, outdoors.tenk, None, "built in: 10,000 triangles for "
               "the survey's Table 1"),
    NamedScene("stadium", 8_000, outdoors.stadium, None, "built in: a teapot in a stadium; "
               "stadium:RATIO sets the teapot's size divided by the stadium's",
               takes_argument=True),
    NamedScene("teapot", 6_320, creatures.teapot, "the Utah teapot",
               "Martin Newell's teapot, tessellated"),
    NamedScene("cloth", 49_928, animation.cloth, None,
               "built in: a sheet that waves, frame by frame"),
    NamedScene("walker", 28_412, walker.walker, None,
               "built in: an animal that walks round a meadow, frame by frame"),
    NamedScene("explosion", 69_451, animation.explosion, None, "built in: the bunny's stand-in, "
               "flying apart frame by frame"),
    NamedScene("boulder", 49_152, images.boulder, None,
               "built in: a geometry image of six charts"),
    NamedScene("knot", 36_864, images.knot, None, "built in: a swept surface, one geometry image"),
    NamedScene("car", 16_384, images.car, "the car of Carr et al. 2006, of five geometry images",
               "not available",
               page="its images were never published; a mesh of your own must be named car.ply"),
    NamedScene("cornell-light", 38, lit.cornell_light, None,
               "built in: the Cornell box under its lamp"),
    NamedScene("statue", 100_002, lit.statue, "the mirrored statue of the survey's "
               "Figure 1", "see buddha"),
    NamedScene("glass-teapot", 12_002, lit.glass_teapot, "the glass teapot of the "
               "survey's Figures 1 and 7", "Martin Newell's teapot, tessellated"),
    NamedScene("soft-shadows", 6_000, lit.soft_shadows, "the soft shadows of the survey's "
               "Figure 7", "not available"),
    NamedScene("cow", 5_804, creatures.cow, "Viewpoint's cow",
               "common-3d-test-models: cow.obj (Viewpoint Animation Engineering)",
               page="https://github.com/alecjacobson/common-3d-test-models publishes the cow; "
               "save its data/cow.obj as cow.obj"),
)}


def find(text: str) -> tuple[NamedScene, float | None] | None:
    """Return the scene that a text such as ``stadium:1e-3`` names, and the argument after the
    colon; None if the text is a path.

    Raises
    ------
    SceneError
        the text is neither a known name nor a path, or the argument is not a ratio above 0 and at
        most 1
    """
    name, _, argument = text.partition(":")
    row = ROWS.get(name) or ROWS.get(name.replace("-", ""))    # soda-hall is sodahall
    if row is not None and not argument:
        return row, None
    if row is not None and row.takes_argument:
        try:
            value = float(argument)
        except ValueError:
            value = np.nan
        if not 0 < value <= 1:
            raise SceneError(f"scene {text!r}: {argument!r} is no ratio; give a number above 0 "
                             "and at most 1, as in stadium:1e-3")
        return row, value
    path = Path(text)
    if path.suffix or path.parent != Path(".") or os.path.exists(text):
        return None
    raise SceneError(f"no scene {text!r}{nearest_name(text, ROWS)} (or give a mesh file's path)")


def named_folders() -> list[Path]:
    """Return the folders that GPGPU_RT_SCENES names; warn of missing folders."""
    words = os.environ.get("GPGPU_RT_SCENES", "").split(os.pathsep)
    given = [Path(word) for word in words if word]
    for folder in given:
        if not folder.is_dir():
            warnings.warn(f"GPGPU_RT_SCENES: there is no folder {folder}; create it, or correct "
                          "the variable", stacklevel=2)
    return given


def data_folder() -> Path:
    """Return this user's folder of fetched scenes, which may be missing."""
    return platformdirs.user_data_path("gpgpu_rt", appauthor=False) / "scenes"


def folders() -> list[Path]:
    """Return the folders in which meshes are searched, in the order of the search."""
    return [*named_folders(), Path("scenes"), data_folder()]


def mesh_path(name: str) -> Path | None:
    """Return the mesh file of a named scene, or None. A scene that can have an argument is always
    built, so it has no mesh file."""
    row = ROWS[name]
    if row.takes_argument:
        return None
    files = [row.file] if row.file else [name + suffix for suffix in SUFFIXES]
    candidates = (folder / file for folder in folders() for file in files)
    return next((path for path in candidates if path.is_file()), None)


def original_file(place: PurePath) -> Path | None:
    """Return a published file that an animation reads, or None if no folder has it.

    Parameters
    ----------
    place : REPOSITORY/PATH, without the repository's owner
    """
    candidates = (folder / PUBLISHED / place for folder in folders())
    return next((path for path in candidates if path.is_file()), None)


def how_to_get(row: NamedScene) -> str:
    """Return the text of the error for a scene whose file ``row.file`` is missing."""
    return (f"scene {row.name!r} is not built in, and no folder of scenes has {row.file}; run "
            f"`gpgpu-rt scenes --fetch {row.name.removesuffix('-moving')}`")


def camera_beside(path: Path) -> Camera | None:
    """Return the camera of a mesh from ``cameras.json`` in the same folder, or None."""
    cameras = path.parent / "cameras.json"
    return load_cameras(cameras).get(path.stem) if cameras.is_file() else None
