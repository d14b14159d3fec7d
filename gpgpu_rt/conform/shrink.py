"""Shrink: reduces a case with a wrong answer to a minimal mesh and ray with the same fault."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..reference import KINDS, acceptance, check
from .answers import EngineAnswers
from .case import Case
from .runner import Crash, Runner
from .spec import Spec
from .suite import Known

# `shrink` tries to round numbers to significands with these numbers of bits.
FEW_BITS = (4, 6, 8, 10, 12, 16, 20)


@dataclass
class Minimal:
    """A minimal case: a ray with a wrong answer, and its triangles.

    Attributes
    ----------
    engine, version, family, kind : the engine that answers wrongly, its version, the family of the
        original case, and the kind of the wrong answer
    case : the ray and the triangles
    answers : the engine's answers
    """

    engine: str
    version: str
    family: str
    kind: str
    case: Case
    answers: EngineAnswers

    def to_python(self) -> str:
        """Return Python text, with exact numbers, for a report to the engine's project: the mesh,
        the ray, the right answer and the engine's answer."""
        known = acceptance(self.case.triangles, *self.case.rays)
        hit = bool(known.exact.hit[0])
        expected = (f"a hit of triangle {known.exact.triangle[0]} at t = "
                    f"{float(known.exact.t[0])!r}" if hit else "a miss")
        found, t = int(self.answers.triangle[0]), self.answers.t
        any_hit = self.answers.any_hit
        told = "" if any_hit is None else (
            f"there is {'a' if any_hit[0] else 'no'} hit, and the nearest is ")
        told += "a miss" if found < 0 else f"a hit of triangle {found}" + (
            "" if t is None else f" at t = {float(t[0])!r}")
        case = self.case
        name = f"{self.engine} {self.version}".strip()
        lines = [f"# {name}: {self.kind}, from a case of the family {self.family}.",
                 f"# Exact arithmetic says {expected};",
                 f"# the engine says {told}. All numbers are exact float32 values.",
                 "import numpy as np", "",
                 f"triangles = np.array({_text(case.triangles)}, np.float32)",
                 f"origin = np.array({_text(case.origins[0])}, np.float32)",
                 f"direction = np.array({_text(case.directions[0])}, np.float32)",
                 f"t_min, t_max = {float(case.t_min.flat[0])!r}, "
                 f"float({str(float(case.t_max.flat[0]))!r})",
                 f"expected_triangle = {int(known.exact.triangle[0])}     # -1 for a miss",
                 f"expected_t = float({str(float(known.exact.t[0]))!r})"]
        return "\n".join(lines) + "\n"


def minimal_cases(spec: Spec, known: Known, runner: Runner) -> list[Minimal]:
    """Return a minimal case for each kind of wrong answer that an engine gives in a family. A kind
    is left out if its first three rays show no fault when each is traced alone."""
    part = slice(0, spec.engine.most)
    try:
        answers, _ = runner.trace(spec, known.case.part(part))
        kinds = known.judge(answers, part).kind
    except (Crash, ValueError):
        return []
    found = []
    for kind in np.unique(kinds[kinds >= KINDS.index("leak")]):
        for ray in np.flatnonzero(kinds == kind)[:3]:
            case = known.case.part(slice(ray, ray + 1))
            if _kind(spec, case, runner)[0] == kind:    # the fault shows without the other rays
                small = shrink(case, lambda one: _kind(spec, one, runner)[0] == kind)
                told = _kind(spec, small, runner)[1]
                assert told is not None
                found.append(Minimal(spec.title, spec.engine.version, known.name, KINDS[kind],
                                     small, told))
                break
    return found


def shrink(case: Case, fails: Callable[[Case], bool]) -> Case:
    """Return a smaller case that still fails: fewer triangles, then numbers with fewer bits.

    The function tries to remove each half of the triangles, then each quarter, and so on (Zeller
    and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", IEEE Transactions on
    Software Engineering 28(2), 2002).

    Parameters
    ----------
    case : a case that fails, with a single ray
    fails : returns whether a case shows the fault
    """
    parts = 2
    while len(case.triangles) > 1:
        groups = np.array_split(np.arange(len(case.triangles)), min(parts, len(case.triangles)))
        for group in groups:
            smaller = replace(case, triangles=np.delete(case.triangles, group, axis=0))
            if len(smaller.triangles) and fails(smaller):
                case, parts = smaller, max(parts - 1, 2)
                break
        else:
            if len(groups) == len(case.triangles):
                break
            parts *= 2
    for bits in FEW_BITS:
        rounder = replace(case, triangles=_rounded(case.triangles, bits),
                          origins=_rounded(case.origins, bits),
                          directions=_rounded(case.directions, bits))
        if (rounder.directions != 0).any() and fails(rounder):
            return rounder
    return case


def _kind(spec: Spec, case: Case, runner: Runner) -> tuple[int, EngineAnswers | None]:
    """Return the verdict (an index into KINDS) on an engine's answer to a ray, and the answer; -1
    and None without a valid answer."""
    try:
        answers, _ = runner.trace(spec, case)
        verdicts = check(case.triangles, case.origins, case.directions, answers.t,
                         answers.triangle, answers.any_hit, case.t_min, case.t_max)
        return int(verdicts.kind[0]), answers
    except (Crash, ValueError):
        return -1, None


def _rounded(values: np.ndarray, bits: int) -> np.ndarray:
    fraction, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(fraction, bits)), exponent - bits).astype(np.float32)


def _text(values: np.ndarray) -> str:
    return repr(values.astype(np.float64).tolist())
