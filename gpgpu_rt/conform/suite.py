"""Suite: lets engines trace every family of cases, and counts wrong answers by kind."""
from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import OptionError, nearest_names
from ..reference import Acceptance, Verdicts, acceptance, check
from ..reference.verdicts import LEAK, UNDECIDABLE, WRONG_KINDS
from .answers import EngineAnswers
from .case import Case
from .engines import ENGINES
from .families import FAMILIES, make_case
from .runner import NO_ANSWER, SECONDS, Crash, Runner
from .spec import ENGINE, FUNCTION, METHOD, Spec

RAYS, SEED = 300, 1     # defaults; RAYS is the largest number of rays of a family
CRASH = "crash"
UNLOADED = "it cannot be loaded"
KINDS = (*WRONG_KINDS, CRASH)


@dataclass
class Row:
    """The result of an engine in a family.

    Attributes
    ----------
    engine, version : The engine, and its package's version or "".
    family : The family's name.
    rays : Number of traced rays; 0 if the engine does not accept their t_min and t_max, gave no
        answer in an earlier family, or cannot be loaded.
    undecidable : Number of rays for which both a hit and a miss are right. Wrong rays
        are not included.
    wrong : Number of wrong rays by kind (KINDS). After a crash, all ``rays`` count as CRASH.
    seconds : Time of the engine's call in seconds, with the construction of its structure.
    note : Why the engine crashed or traced no ray; else "".
    own : For a wrapper of another engine, the number of wrong rays that the other engine answers
        correctly; else None.
    """

    engine: str
    version: str
    family: str
    rays: int
    undecidable: int
    wrong: dict[str, int]
    seconds: float
    note: str = ""
    own: int | None = None

    @property
    def wrong_rays(self) -> int:
        return sum(self.wrong.values())

    @property
    def failure(self) -> str:
        """NO_ANSWER after a timeout, CRASH after another failure, else ""."""
        if not (self.note and self.rays):
            return ""
        return NO_ANSWER if self.note.startswith(NO_ANSWER) else CRASH

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass
class Known:
    """A family's case and its right answers."""

    name: str
    case: Case
    answers: Acceptance

    @classmethod
    def of(cls, name: str, rays: int, seed: int = SEED) -> Known:
        """Make the case, with at most ``rays`` rays, and its right answers."""
        case = make_case(name, min(rays, FAMILIES[name].most), seed)
        return cls(name, case, acceptance(case.triangles, *case.rays))

    def judge(self, answers: EngineAnswers, part: slice) -> Verdicts:
        """Judge the answers to ``part``, a slice that begins at the first ray."""
        case = self.case.part(part)
        known = first_rays(self.answers, len(case.origins))
        return check(case.triangles, case.origins, case.directions, answers.t, answers.triangle,
                     answers.any_hit, case.t_min, case.t_max, known)


def first_rays(known: Acceptance, n: int) -> Acceptance:
    if n == len(known):
        return known
    end, exact = known.starts[n], known.exact
    hits = type(exact)(exact.t[:n], exact.u[:n], exact.v[:n], exact.triangle[:n], exact.status[:n])
    return Acceptance(hits, known.must_hit[:n], known.may_hit[:n], known.starts[:n + 1],
                      known.triangle[:end], known.t_low[:end], known.t_high[:end], known.copy_of)


def family_names(words: Sequence[str] = ()) -> list[str]:
    """Return ``words``, which must be names of families; without words, all names.

    Raises
    ------
    OptionError
        a name is not the name of a family
    """
    for word in words:
        if word not in FAMILIES:
            raise OptionError(f"no family {word!r}{nearest_names(word, FAMILIES)}")
    return list(words) or list(FAMILIES)


def installed() -> tuple[list[Spec], dict[str, str]]:
    """Return the installed engines; and, for each missing engine, why it is not run."""
    missing = {name: engine.missing for name, engine in ENGINES.items() if engine.missing}
    return [Spec(ENGINE, name) for name in ENGINES if name not in missing], missing


def run(specs: Sequence[Spec], names: Iterable[str], rays: int = RAYS, seed: int = SEED,
        seconds: float = SECONDS) -> Iterator[Row]:
    """Yield the `Row` of each engine and family; an engine has at most ``seconds`` for a case.

    Raises
    ------
    OptionError
        a user's function cannot be loaded; raised before any engine runs
    """
    # A wrapper runs after its engine, whose wrong rays `_row` needs. Every engine has its own
    # process, because an engine may change the state of its process. Methods share a process.
    ordered = sorted(dict.fromkeys(specs), key=lambda spec: bool(spec.engine.wraps))
    with ExitStack() as stack:
        runners = {key: stack.enter_context(Runner(seconds)) for key in map(_process_of, ordered)}
        idle: dict[str, str] = {}
        for spec in ordered:
            if spec.kind == METHOD:
                continue
            try:
                runners[_process_of(spec)].load(spec)
            except Crash as failure:
                if spec.kind == FUNCTION:
                    raise OptionError(f"--engine {spec.name!r} cannot be loaded ({failure}); give "
                                      "MODULE:FUNCTION") from None
                idle[spec.title] = f"{UNLOADED}: {failure}"
        for name in dict.fromkeys(names):
            known = Known.of(name, rays, seed)
            wrong: dict[str, np.ndarray] = {}
            for spec in ordered:
                row = _row(runners[_process_of(spec)], spec, known, wrong, idle)
                if row.failure == NO_ANSWER:      # do not wait for this engine again
                    idle[spec.title] = f"it gave no answer in {name}"
                yield row


def not_loaded(rows: Sequence[Row]) -> dict[str, str]:
    """Return engine -> note for the engines that cannot be loaded."""
    return {row.engine: row.note for row in rows if not row.rays and UNLOADED in row.note}


def notes_of(rows: Sequence[Row], missing: Mapping[str, str]) -> list[str]:
    """Return lines on crashes, and on engines that did not run. ``missing`` holds the engines that
    are not installed, and why they did not run."""
    return list(dict.fromkeys([
        *(f"{row.engine}, {row.family}: {row.note}" for row in rows if row.note and row.rays),
        *(f"{name} was {note}" for name, note in not_loaded(rows).items()),
        *(f"{name} was not run: {why}" for name, why in missing.items())]))


def _process_of(spec: Spec) -> str:
    return METHOD if spec.kind == METHOD else spec.title


def _row(runner: Runner, spec: Spec, known: Known, wrong: dict[str, np.ndarray],
         idle: Mapping[str, str]) -> Row:
    """Return the `Row` of an engine and a family.

    Parameters
    ----------
    wrong : engine -> (n,) bool, its wrong rays, for the engines that have already answered
    idle : engine -> the reason why the engine does not run any more
    """
    engine, none = spec.engine, dict.fromkeys(KINDS, 0)
    row = Row(spec.title, engine.version, known.name, 0, 0, none, 0.0)
    if not engine.traces(known.case):
        row.note = "the engine does not accept the t_min or t_max of these rays"
        return row
    if spec.title in idle:
        row.note = f"not run, because {idle[spec.title]}"
        return row
    part = slice(0, engine.most)
    case = known.case.part(part)
    row.rays = len(case.origins)
    try:
        answers, row.seconds = runner.trace(spec, case)
        verdicts = known.judge(answers, part)
    except (Crash, ValueError) as failure:
        row.note, row.wrong = str(failure), {**none, CRASH: row.rays}
        return row
    counts = verdicts.counts
    row.undecidable = int((verdicts.kind == UNDECIDABLE).sum())
    row.wrong = {kind: counts.get(kind, 0) for kind in KINDS}
    wrong[spec.title] = verdicts.kind >= LEAK
    behind = wrong.get(engine.wraps)
    if behind is not None:
        row.own = int((wrong[spec.title] & ~behind[:row.rays]).sum())
    return row
