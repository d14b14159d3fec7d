"""Crate: ``out/ro-crate-metadata.json`` describes the folder of drawn pages as an RO-Crate 1.1.

An RO-Crate (https://w3id.org/ro/crate/1.1) is a folder with a description in JSON-LD. This
description lists every file with its size and SHA-256 digest, the program's version and commit,
and the environment of the run. `faults` checks a folder against the description.
"""
from __future__ import annotations

import datetime
import hashlib
import json
import mimetypes
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from gpgpu_rt.disk.files import WRITING, open_input, read_json
from gpgpu_rt.errors import Error
from gpgpu_rt.gl.environment import RunEnvironment, environment

from . import provenance
from .output import write_text

NAME = "ro-crate-metadata.json"
# RO-Crate 1.1 has no term for a digest, so the description adds schema.org's term.
CONTEXT = ["https://w3id.org/ro/crate/1.1/context", {"sha256": "http://schema.org/sha256"}]
PROFILE = "https://w3id.org/ro/crate/1.1"
ROOT, RUN, PROGRAM, RENDERER, PROCESSOR = "./", "#run", "#gpgpu_rt", "#renderer", "#processor"
LICENCE = "https://spdx.org/licenses/MIT"
_TYPES = {".md": "text/markdown", ".csv": "text/csv", ".json": "application/json"}
# Id of an entity -> the properties that it must have.
_NEEDED = {
    ROOT: ("name", "description", "datePublished", "license", "hasPart"),
    RUN: ("endTime", "instrument", "result"),
    PROGRAM: ("name", "softwareVersion", "identifier", "softwareRequirements"),
    RENDERER: ("name", "softwareVersion"),
    PROCESSOR: ("name", "value"),
    "#python": ("name", "softwareVersion"),
    "#system": ("name",),
}


def write(out: Path) -> None:
    """Write the description of all files in the folder ``out``, completely or not at all."""
    listed = [_file(path, out) for path in _files(out)]
    graph = [{"@id": NAME, "@type": "CreativeWork", "conformsTo": {"@id": PROFILE},
              "about": {"@id": ROOT}},
             {"@id": ROOT, "@type": "Dataset", "name": "Figures of gpgpu_rt",
              "description": "The figures of Hachisuka's survey Ray Tracing on Graphics Hardware, "
              "measured by gpgpu_rt and compared with the published numbers",
              "datePublished": datetime.date.today().isoformat(), "license": {"@id": LICENCE},
              "hasPart": [{"@id": entry["@id"]} for entry in listed],
              "mentions": {"@id": RUN}},
             {"@id": LICENCE, "@type": "CreativeWork", "name": "MIT License"},
             *_made_with(environment()), *listed]
    write_text(out / NAME, json.dumps({"@context": CONTEXT, "@graph": graph}, indent=1) + "\n")


def faults(out: Path) -> list[str]:
    """Return a line for each difference between a folder and its description.

    Raises
    ------
    Error
        if the folder has no description, or if the description is not an RO-Crate 1.1
    """
    entities = _entities(out)
    found = [f"{NAME}: {name} has no {key}" for name, keys in _NEEDED.items()
             for key in keys if not entities.get(name, {}).get(key)]
    parts = {part["@id"] for part in _list(entities.get(ROOT, {}).get("hasPart"))
             if isinstance(part, dict) and isinstance(part.get("@id"), str)}
    for name in sorted(parts):
        found += _file_faults(unquote(name), entities.get(name, {}), out)
    unlisted = {quote(path.relative_to(out).as_posix()) for path in _files(out)} - parts
    return found + [f"{unquote(name)}: the file is not listed" for name in sorted(unlisted)]


def count(out: Path) -> int:
    """Return the number of files that the description of a folder lists."""
    return len(_list(_entities(out).get(ROOT, {}).get("hasPart")))


def _files(out: Path) -> Iterator[Path]:
    """Yield the folder's regular files, sorted by name, without the description."""
    for path in sorted(out.rglob("*")):
        if (stat.S_ISREG(path.lstat().st_mode) and path != out / NAME
                and not path.name.startswith(WRITING)):
            yield path


def _file(path: Path, out: Path) -> dict[str, Any]:
    """Return the entity of a file. The entity of a page also names the page's measurements."""
    entry = {"@id": quote(path.relative_to(out).as_posix()), "@type": "File", "name": path.name,
             "contentSize": str(path.stat().st_size), "sha256": _digest(path),
             "encodingFormat": _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
             or "application/octet-stream"}
    page = provenance.held(path.stem, out) if path.suffix == ".md" else None
    if page is not None:
        entry["description"] = provenance.summary(page)
    return entry


def _made_with(found: RunEnvironment) -> list[dict[str, Any]]:
    libraries = [_software(f"#{name}", name, version) for name, version in found.libraries.items()]
    kept = {"@id": "#commit", "@type": "PropertyValue", "name": "commit",
            "value": found.commit or "unknown: not in a repository"}
    program = {**_software(PROGRAM, "gpgpu_rt", found.version), "identifier": {"@id": "#commit"},
               "softwareRequirements": [{"@id": entry["@id"]} for entry in libraries]}
    tools = [program, _software("#python", "Python", found.python),
             _software(RENDERER, found.renderer, found.opengl),
             {"@id": PROCESSOR, "@type": "PropertyValue", "name": "processor",
              "value": found.processor},
             {"@id": "#system", "@type": "OperatingSystem", "name": found.system}]
    now = datetime.datetime.now(datetime.timezone.utc)
    run = {"@id": RUN, "@type": "CreateAction", "name": "python -m gpgpu_rt.figures",
           "endTime": now.isoformat(timespec="seconds"), "result": {"@id": ROOT},
           "instrument": [{"@id": tool["@id"]} for tool in tools]}
    return [run, *tools, kept, *libraries]


def _software(name: str, title: str, version: str) -> dict[str, Any]:
    return {"@id": name, "@type": "SoftwareApplication", "name": title,
            "softwareVersion": version}


def _digest(path: Path) -> str:
    with open_input(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _list(value: Any) -> list[Any]:
    """Return the value of a JSON-LD property as a list. A single value becomes a list of one."""
    return value if isinstance(value, list) else [] if value is None else [value]


def _entities(out: Path) -> dict[str, dict[str, Any]]:
    path = out / NAME
    again = "run `python -m gpgpu_rt.figures` to write it again"
    try:
        found = read_json(path)
    except OSError as failure:
        raise Error(f"cannot read {path}: {failure.strerror}; {again}") from failure
    except ValueError as failure:
        raise Error(f"{path} is not JSON: {failure}; {again}") from failure
    graph = found.get("@graph") if isinstance(found, dict) else None
    entities = {entity["@id"]: entity for entity in _list(graph)
                if isinstance(entity, dict) and isinstance(entity.get("@id"), str)}
    if entities.get(NAME, {}).get("conformsTo") != {"@id": PROFILE} or ROOT not in entities:
        raise Error(f"{path} does not describe an RO-Crate 1.1; {again}")
    return entities


def _file_faults(name: str, entity: dict[str, Any], out: Path) -> list[str]:
    path = out / name
    if not path.resolve().is_relative_to(out.resolve()):
        return [f"{name}: the file is outside of the folder"]
    try:
        size, digest = path.stat().st_size, _digest(path)
    except (OSError, ValueError):
        return [f"{name}: the file is missing"]
    wrong = [f"{name}: {key} is {entity.get(key)}, but the file has {value}"
             for key, value in (("contentSize", str(size)), ("sha256", digest))
             if entity.get(key) != value]
    return wrong if entity.get("@type") == "File" else [f"{name}: its @type is not File", *wrong]
