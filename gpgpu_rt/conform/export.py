"""Export: writes the conformance suite as plain data, for the tests of other projects.

A family's rays and answers are in ``NAME.json`` and in ``NAME.npz``. ``schema.json`` describes
the JSON files. ``read_cases.py``, which needs only Python, reads a JSON file and judges a
tracer's answers.
"""
from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.files import read_json, replacing
from ..reference import Acceptance, acceptance
from .case import Case
from .families import FAMILIES, make_case

FORMAT = "gpgpu_rt conformance suite, version 1"
HERE = Path(__file__).parent
READER, SCHEMA, INDEX = "read_cases.py", "schema.json", "index.json"


def case_to_dict(case: Case) -> dict[str, Any]:
    """Return the triangles and rays of a case for JSON; an infinite t_min or t_max is None."""
    n = len(case.origins)
    ends = {name: [None if np.isinf(value) else value
                   for value in np.broadcast_to(getattr(case, name), n).tolist()]
            for name in ("t_min", "t_max")}
    return {"triangles": case.triangles.tolist(), "origins": case.origins.tolist(),
            "directions": case.directions.tolist(), **ends}


def answers_to_dict(known: Acceptance) -> dict[str, Any]:
    """Return the right answers for JSON."""
    exact, entries = known.exact, list(zip(known.triangle.tolist(), known.t_low.tolist(),
                                           known.t_high.tolist()))
    bounds = known.starts.tolist()
    return {"exact_triangle": exact.triangle.tolist(),
            "exact_t": [t if hit else None for t, hit in zip(exact.t.tolist(), exact.hit)],
            "must_hit": known.must_hit.tolist(), "may_hit": known.may_hit.tolist(),
            "acceptable": [entries[a:b] for a, b in zip(bounds, bounds[1:])],
            "copy_of": known.copy_of.tolist()}


def arrays(case: Case, known: Acceptance) -> dict[str, np.ndarray]:
    """Return a case and its right answers for an .npz file."""
    n = len(case.origins)
    return {"triangles": case.triangles, "origins": case.origins, "directions": case.directions,
            "t_min": np.broadcast_to(case.t_min, n), "t_max": np.broadcast_to(case.t_max, n),
            "exact_triangle": known.exact.triangle, "exact_t": known.exact.t,
            "must_hit": known.must_hit, "may_hit": known.may_hit, "starts": known.starts,
            "triangle": known.triangle, "t_low": known.t_low, "t_high": known.t_high,
            "copy_of": known.copy_of}


def digest(case: Case) -> str:
    """Return the SHA-256 digest of triangles and rays, equal on every machine."""
    total = hashlib.sha256()
    for array in (case.triangles, *case.rays):
        little = np.ascontiguousarray(np.broadcast_to(
            array, array.shape or (len(case.origins),)), "<f4")
        total.update(little.tobytes())
    return total.hexdigest()


def export(folder: Path, names: Iterable[str], rays: int, seed: int) -> Iterator[str]:
    """Write families into a folder, and yield the name of each written family.

    Parameters
    ----------
    folder : an existing folder
    names : names of families
    rays, seed : the number of rays of each family (at most `Family.most`), and the seed
    """
    families: list[dict[str, Any]] = []
    for name in names:
        family = FAMILIES[name]
        case = make_case(name, min(rays, family.most), seed)
        known = acceptance(case.triangles, *case.rays)
        told = {"format": FORMAT, "family": name, "what": family.what, "seed": seed,
                "digest": digest(case), "closed": case.closed, **case_to_dict(case),
                **answers_to_dict(known)}
        _write(folder / f"{name}.json", told)
        with replacing(folder / f"{name}.npz") as file:
            np.savez_compressed(file, **arrays(case, known))
        families.append({"family": name, "what": family.what, "digest": told["digest"],
                         "seed": seed, "triangles": len(case.triangles),
                         "rays": len(case.origins)})
        yield name
    written = {one["family"] for one in families}
    families += [one for one in _listed(folder) if one["family"] not in written]
    _write(folder / INDEX, {"format": FORMAT, "families": families})
    for name in (READER, SCHEMA):
        with replacing(folder / name) as file:
            shutil.copyfile(HERE / name, file)


def _listed(folder: Path) -> list[dict[str, Any]]:
    try:
        index = read_json(folder / INDEX)
        return [one for one in index["families"] if index["format"] == FORMAT
                and (folder / f"{one['family']}.json").is_file() and one["seed"] is not None]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _write(path: Path, told: dict[str, Any]) -> None:
    with replacing(path) as file:
        file.write_text(json.dumps(told, allow_nan=False), encoding="utf-8")
