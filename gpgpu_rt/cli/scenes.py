"""``gpgpu-rt scenes``: list the named scenes, and fetch the papers' scenes."""
from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import sys
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..disk.files import check_writable, is_file, read_input, read_json
from ..errors import Error, OptionError, SceneError, nearest_names
from ..scene import catalogue
from ..scene.camera import load_cameras
from ..scene.loading import list_scenes
from ..scene.originals.conversion import ORIGINALS, convert
from ..scene.originals.download import download
from ..scene.originals.sources import SourceFile, camera_text, is_url, source_files
from ..text_format import counted
from .folder_lock import FolderLock
from .progress import show_progress, tenths
from .shared import Command, print_json, print_table, say

KILOBYTE = 1000


def add_commands(command: Command) -> None:
    sub = command("scenes", _run, "list the named scenes and the source of each, or fetch the "
                  "papers' scenes")
    sub.add_argument("--fetch", nargs="*", metavar="NAME", help="download these scenes and "
                     f"convert them; without a name: {', '.join(ORIGINALS)}. The command shows "
                     "the size and the terms of each scene and asks before the download")
    sub.add_argument("--from", dest="base", metavar="URL|FOLDER", help="read the files "
                     "REPOSITORY/PATH below this URL or folder; default: download them from the "
                     "repositories that publish them")
    sub.add_argument("--yes", action="store_true", help="agree to the terms and do not ask")


def _run(chosen: argparse.Namespace) -> None:
    if chosen.fetch is not None:
        words = [word for text in chosen.fetch for word in text.split(",") if word]
        fetch(words or list(ORIGINALS), chosen.base, chosen.yes)
        if not chosen.json:
            return
    elif chosen.base or chosen.yes:
        raise OptionError("--from and --yes belong to --fetch; add --fetch")
    rows = list_scenes()
    if chosen.json:
        return print_json(rows)
    print_table(("scene", "triangles", "source", "original"),
                [(r["name"], "?" if r["triangles"] is None else f"{r['triangles']:,}", r["found"],
                  r["original"]) for r in rows])
    print(f"\n`gpgpu-rt scenes --fetch` downloads {', '.join(ORIGINALS)}.")
    for row in catalogue.ROWS.values():
        if row.page and catalogue.mesh_path(row.name) is None:
            print(f"{row.name}: {row.page}")
    print("Meshes are searched in the folders of GPGPU_RT_SCENES, then in ./scenes, then in "
          f"{catalogue.data_folder()}.")


def fetch(names: Sequence[str], base: str | None, agreed: bool) -> None:
    """Download scenes, convert them, and put them where `load_scene` finds them.

    Parameters
    ----------
    names : names of ORIGINALS
    base : URL or folder of a copy of the originals; None for the repositories that publish them
    agreed : whether the user agrees to the terms; if false, the user is asked

    Raises
    ------
    Error
        if a scene cannot be fetched; finished scenes are kept
    """
    names = list(dict.fromkeys(name.removesuffix("-moving") for name in names))
    for name in names:
        _check_name(name)
    _check_base(base)
    with warnings.catch_warnings():
        # `_working` creates a missing folder of GPGPU_RT_SCENES, so a warning is not needed.
        warnings.simplefilter("ignore")
        folder = next(iter(catalogue.named_folders()), catalogue.data_folder())
        wanted = [name for name in names if not _is_there(name)]
    for name in names:
        if name not in wanted:
            say(f"{name} is there: {catalogue.mesh_path(name)}")
    if not wanted:
        return
    if folder.is_dir():
        check_writable(folder / f"{wanted[0]}.ply")
    _show(wanted, folder, base)
    if not agreed:
        _ask()
    try:
        _fetch(wanted, base, folder)
    except KeyboardInterrupt:
        say("interrupted; the same command keeps the downloaded files and continues")
        raise
    for name in wanted:
        print(f"{name}: {ORIGINALS[name].triangles:,} triangles, {catalogue.mesh_path(name)}")


def _fetch(wanted: Sequence[str], base: str | None, folder: Path) -> None:
    cameras = folder / "cameras.json"
    if is_file(cameras):
        load_cameras(cameras)      # report a damaged file before the download
    with _working(folder) as work, show_progress("kilobyte", tenths("kilobyte")) as report:
        missing = {name: _missing_files(name, folder) for name in wanted}
        total = -(-sum(file.size for files in missing.values() for file in files) // KILOBYTE) or 1
        done = 0
        for name in wanted:
            for file in missing[name]:
                download(file, base, work / file.sha256,
                         lambda there: report((done + there) // KILOBYTE, total, name))
                done += file.size
                if ORIGINALS[name].keeps_files:
                    place = folder / catalogue.PUBLISHED / file.place
                    place.parent.mkdir(parents=True, exist_ok=True)
                    (work / file.sha256).replace(place)
            # Write the mesh last: a scene with a mesh counts as fetched.
            _add_camera(name, cameras, work)
            _convert(name, folder, work)
        report(total, total, "")


def _check_base(base: str | None) -> None:
    if base is None or is_url(base):
        return
    repositories = sorted({file.place.parts[0] for files in source_files().values()
                           for file in files})
    if not Path(base).is_dir():
        host = base.partition("/")[0].partition(":")[2].isdigit()
        raise OptionError(f"--from {base}: there is no such folder"
                          + (f"; did you mean http://{base}?" if host else "; check the path"))
    if not any(Path(base, name).is_dir() for name in repositories):
        raise OptionError(f"--from {base}: the folder has none of {', '.join(repositories)}; give "
                          "the folder that holds the originals as REPOSITORY/PATH")


def _check_name(name: str) -> None:
    if name in ORIGINALS:
        return
    row = catalogue.ROWS.get(name)
    if row is None:
        raise SceneError(f"no scene {name!r} to fetch{nearest_names(name, catalogue.ROWS)}")
    if row.stand_in is None:
        raise SceneError(f"{name} is built in, so there is nothing to fetch")
    raise SceneError(f"{name} cannot be fetched: {row.page or row.original}; these scenes can: "
                     f"{', '.join(ORIGINALS)}")


def _is_there(name: str) -> bool:
    files = source_files()[name] if ORIGINALS[name].keeps_files else ()
    return catalogue.mesh_path(name) is not None and all(
        (path := catalogue.original_file(file.place)) is not None
        and path.stat().st_size == file.size for file in files)


def _show(names: Sequence[str], folder: Path, base: str | None) -> None:
    for name in names:
        files = source_files()[name]
        size = sum(file.size for file in files) / 1e6
        say(f"{name}: {counted(len(files), 'file')}, {size:.1f} MB\n"
            f"    source: github.com/{files[0].repository} at {files[0].commit[:12]}"
            + (f", taken from {base}" if base else "") + f"\n    terms: {files[0].terms}")
    say(f"The scenes will be saved in {folder}.")


def _ask() -> None:
    """Raise Error unless the user agrees to fetch the scenes."""
    if not sys.stdin or not sys.stdin.isatty():
        raise Error("nothing is fetched: without a terminal, give --yes to agree to the terms")
    print("Fetch these scenes and agree to their terms? [y/N] ", end="", file=sys.stderr,
          flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise Error("nothing is fetched")


@contextlib.contextmanager
def _working(folder: Path) -> Iterator[Path]:
    """Yield a folder in ``folder`` for partial downloads, locked against other runs. At the end,
    remove the empty folders that this run made."""
    created = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise Error(f"cannot create the folder {folder}: {failure.strerror}; name another folder "
                    "by GPGPU_RT_SCENES") from failure
    work = folder / ".fetching"
    lock = FolderLock(work, folder)
    try:
        yield work
    finally:
        lock.release()
        with contextlib.suppress(OSError):      # a folder that is not empty stays
            for path in (work, *created):
                path.rmdir()


def _missing_files(name: str, folder: Path) -> list[SourceFile]:
    return [file for file in source_files()[name]
            if not is_file(path := folder / catalogue.PUBLISHED / file.place)
            or hashlib.sha256(read_input(path)).hexdigest() != file.sha256]


def _convert(name: str, folder: Path, work: Path) -> None:
    """Write a scene's mesh if it is missing. Then remove the downloaded files, unless the scene's
    animation reads them."""
    files, stay = source_files()[name], ORIGINALS[name].keeps_files
    paths = [folder / catalogue.PUBLISHED / file.place if stay else work / file.sha256
             for file in files]
    if catalogue.mesh_path(name) is None:
        convert(name, paths, work).replace(folder / f"{name}.ply")
    if not stay:
        for path in paths:
            path.unlink()


def _add_camera(name: str, path: Path, work: Path) -> None:
    cameras = read_json(path) if is_file(path) else {}
    camera = json.loads(camera_text()).get(name)
    if camera is None or name in cameras:
        return
    temporary = work / path.name
    temporary.write_text(json.dumps({**cameras, name: camera}, indent=1) + "\n")
    temporary.replace(path)
