"""Tune: find the fastest method, schedule, precision and options within error bounds on a scene.

Knobs are the options that the search may change. A candidate is a method with values for its
knobs. The search has four stages:

1. Time every method with its default options on a few rays. Methods that are far slower than the
   fastest method are tried last.
2. For each method that is not far slower, try the speed knobs one after another and keep the best
   few candidates (beam search). Speed knobs do not change the hits.
3. Combine the best candidates with the options that change the accuracy. Drop a combination if its
   errors on some thousand rays already exceed the bounds. Time the faster half of the remaining
   candidates on more and more rays (successive halving).
4. Test the candidates in order of speed, each on at least as many rays as the proof needs. Confirm
   the winner on as many new rays, because the rays that selected a candidate favour it.

`Promise.split` decides whether the search runs once, or twice: for coherent rays, timed on eye
rays, and for incoherent rays, timed on random rays. A tracer picks one of the two results
according to its rays.

Two assumptions let the search skip most combinations. First, if a candidate is faster than another
at default accuracy, it is faster at every accuracy. Second, if a value of an option exceeds the
bounds while all other accuracy options have their defaults, every combination with this value
exceeds the bounds.
"""
from __future__ import annotations

import hashlib
import itertools
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

from ..errors import LimitError, OptionError
from ..gl.context import open_gpu
from ..hits import Hits
from ..methods import find_method, methods, settings
from ..methods.choices import Choice, Choices
from ..scene.scene import Scene
from ..tracer import Tracer
from .candidates import STEP_ROOM, Candidate, accuracy_knobs, speed_knobs
from .error_targets import ALL, Finding, Promise
from .known_rays import KnownRays, bytes_in_flight
from .tuning_results import Search, Trial, Tuning

# Numbers of rays for the first timing, for most timings, and for the last timing: square numbers,
# so that the rays fill square textures.
PROBE, SCREEN, FIELD = 1 << 10, 1 << 14, 1 << 16
FAR_BEHIND = 4.0      # a method this many times slower than the fastest on PROBE rays comes last
BEHIND = 2.0          # a candidate this many times slower than the fastest is tried later
BEAM = 2              # candidates of a method that are kept after each knob
WAVE = 4              # candidates that are judged together
RUNS = 5              # timed runs of a candidate
FEW_RUNS = 3          # timed runs on few rays: another process could disturb a single run
LATE = "the time ran out: some candidates were not tried"     # a note of a search


def tune(scene: Scene, promise: Promise, rays: int | None = None, seed: int = 0,
         budget: float = 300.0, names: Sequence[str] | None = None,
         report: Callable[[str], None] = lambda line: None) -> Tuning:
    """Find the fastest candidate whose errors keep the bounds of ``promise``.

    Parameters
    ----------
    scene : Scene
    promise : The bounds.
    rays : Number of rays for the proof, and of new rays for the confirmation. The number is raised
        if it is too small for the proof.
    seed : Seed of all rays.
    budget : Seconds for all searches together; each search spends at most half of its time on
        speed options. When the time is over, the tuner tries no new candidate and proves the
        fastest known candidates.
    names : Methods to try; None for all methods.
    report : Function that is called with each line about progress.
    """
    chosen = [row.name for row in methods()] if names is None else list(names)
    for name in chosen:
        find_method(name)
    parts, searches = promise.split(), []
    for rays_of, (part, timed_on) in parts.items():
        if len(parts) > 1:
            report(f"for {rays_of} rays, timed on {timed_on} rays")
        searches.append(_Searcher(scene, part, rays, seed, budget / len(parts), report, rays_of,
                                  timed_on).run(chosen))
        if searches[-1].choice is None:
            return Tuning(searches, None)
    first, last = searches[0].choice, searches[-1].choice
    assert first is not None and last is not None
    return Tuning(searches, settings.Settings(settings.describe(scene), open_gpu().renderer,
                                              Choices(first, last)))


def keeps(found: Choice, scene: Scene, seed: int) -> bool:
    """Return whether a choice keeps its error bounds on new rays, which ``seed`` determines.

    As many rays are traced as in the proof. The measured shares of wrong hits and of large errors
    must keep the bounds; confidence is not considered.
    """
    asked, measured = found.promise, found.measured
    known = KnownRays(scene, measured["rays"], seed, asked["kinds"])
    with Tracer(scene, found.method, **found.options) as tracer:
        answers = known.judge(known.trace(tracer)[0])
    past, compared = answers.over(asked["max_t_error"])
    return (answers.wrong.mean() <= asked["max_wrong"]
            and past <= (1 - asked["t_quantile"]) * compared)


class _Searcher:
    def __init__(self, scene: Scene, promise: Promise, rays: int | None, seed: int,
                 budget: float, report: Callable[[str], None], rays_of: str = ALL,
                 timed_on: str | None = None) -> None:
        self.scene, self.promise, self.seed, self.report = scene, promise, seed, report
        self.rays_of, self.timed_kinds = rays_of, (timed_on,) if timed_on else promise.kinds
        self.half_time = time.monotonic() + budget / 2      # deadline for trying speed options
        self.deadline = time.monotonic() + budget
        self.notes: list[str] = []
        self.trials: dict[Candidate, Trial] = {}
        self._known: dict[tuple[int, int, tuple[str, ...]], KnownRays] = {}
        self._findings: dict[bytes, Finding] = {}
        self._steps: dict[Candidate, int] = {}
        self.rays = self._enough(rays)

    def _enough(self, rays: int | None) -> int:
        """Return the larger of ``rays`` and the number of rays that the proof needs. The proof
        compares t only at right hits; the factor 0.9 leaves a margin for wrong hits.
        """
        hit_share = float(self._rays(SCREEN).truth.hit.mean())
        needed = self.promise.rays_needed(0.9 * hit_share)
        if rays is not None and rays < needed:
            self._say(f"{rays:,} rays cannot prove these bounds; their number was raised to "
                      f"{needed:,}")
        return max(rays or 0, needed)

    def run(self, names: list[str]) -> Search:
        chosen = None
        for wave in self._waves(names):
            chosen = self._settle(wave)
            if chosen is not None:
                break
        trials = sorted(self.trials.values(),
                        key=lambda t: (-t.rates.get(SCREEN, 0.0), -t.rays_per_second))
        if chosen is not None:
            for trial in trials:
                if trial.outcome == "not reached":
                    trial.compare(chosen)
        return Search(self.rays_of, self.promise, self.rays, self.seed, self.notes, trials, chosen,
                      None if chosen is None else self._choice(chosen))

    # The stages -----------------------------------------------------------------------------

    def _waves(self, names: list[str]) -> Any:
        """Yield lists of trials with default accuracy, the fastest first. Far slower methods come
        last, and their speed options are not tuned.
        """
        self.report(f"{len(names)} methods on {PROBE:,} rays")
        probed = self._timed([Candidate(name) for name in names], PROBE, FEW_RUNS)
        known = [t for t in probed if not t.misses]
        if not known:
            return
        fastest = known[0].rays_per_second
        near = [t for t in known if FAR_BEHIND * t.rays_per_second >= fastest]
        far = [t for t in known if t not in near]
        for trial in far:
            trial.note = (f"{fastest / trial.rays_per_second:.0f} times slower than "
                          f"{known[0].candidate} on {PROBE:,} rays")
        best: list[Trial] = []
        for trial in near:
            best += self._beam(trial.candidate)
        # Time the best again in alternation: other processes may have slowed some trials.
        fit = [t for t in self._timed([t.candidate for t in best], SCREEN, RUNS) if not t.misses]
        close = [t for t in fit if BEHIND * t.rays_per_second >= fit[0].rays_per_second]
        for part in (close, [t for t in fit if t not in close], far):
            for at in range(0, len(part), WAVE):
                if part is far and self._late():
                    return
                yield part[at:at + WAVE]

    def _beam(self, start: Candidate) -> list[Trial]:
        """Return the fastest few combinations of a method's speed options, found knob by knob.
        Combinations that keep the bound on bytes come first."""
        beam = self._timed([start], SCREEN, RUNS)
        for changes in speed_knobs(start.method):
            if time.monotonic() > self.half_time:
                break
            self.report(f"{start.method}: {', '.join(sorted({k for c in changes for k in c}))}")
            more = [t.candidate.changed(**change) for t in beam for change in changes]
            more = [c for c in dict.fromkeys(more) if c not in self.trials]
            beam = sorted(_fastest(beam + self._timed(more, SCREEN, RUNS)),
                          key=lambda t: bool(t.misses))[:BEAM]
        return beam

    def _settle(self, wave: list[Trial]) -> Trial | None:
        """Combine the candidates of a list from `_waves` with accuracy options. Return the fastest
        trial that keeps the bounds, or None.
        """
        alive: list[Candidate] = []
        for method in dict.fromkeys(t.candidate.method for t in wave):
            mine = [t.candidate for t in wave if t.candidate.method == method]
            alive += [self._relaxed(config, change) for change in self._hopeful(mine[0])
                      for config in mine]
        ahead = self._halved(alive)
        for trial in ahead:
            if self._proved(trial):
                return trial
            if self._late() and not trial.candidate.accuracy:
                break
        return None

    def _hopeful(self, config: Candidate) -> list[dict[str, Any]]:
        """Return the combinations of accuracy options that may keep the bounds.

        A combination is dropped if its errors on some thousand rays, or the errors of one of its
        values alone, already exceed the bounds.
        """
        combinations: list[dict[str, Any]] = [{}] if self._screen(config) else []
        survivors = []
        for changes in accuracy_knobs(config.method):
            survivors.append([{}, *(change for change in changes if not self._late()
                                    and self._screen(self._relaxed(config, change)))])
        for parts in itertools.product(*survivors):
            change = {name: value for part in parts for name, value in part.items()}
            several = sum(map(bool, parts)) > 1
            if change and (not several or not self._late()
                           and self._screen(self._relaxed(config, change))):
                combinations.append(change)
        return combinations

    def _relaxed(self, config: Candidate, change: dict[str, Any]) -> Candidate:
        """Return the candidate with changed accuracy options. Unless only the intersection test
        changes, add a step cap: low precision can send a ray around an endless loop, which the
        default cap, a bound on any search of the structure, would end late.
        """
        if set(change) <= {"intersection"}:
            return config.changed(**change)
        if config not in self._steps:
            self._steps[config] = self._rays(SCREEN).most_steps(config.method,
                                                                dict(config.options))
        return config.changed(**change, step_cap=STEP_ROOM * self._steps[config])

    def _halved(self, candidates: list[Candidate]) -> list[Trial]:
        """Return trials of the candidates that can run and keep the bound on bytes, fastest first.

        Time the faster half again on twice the rays, and repeat this up to FIELD rays.
        """
        size, ahead = SCREEN, self._timed(candidates, SCREEN, RUNS)
        while ahead and size < FIELD and not self._late():
            size = min(FIELD, 2 * size)
            ahead = [t for t in ahead if not t.misses]
            half = max(WAVE, len(ahead) // 2)
            self.report(f"the {min(half, len(ahead))} fastest on {size:,} rays")
            ahead = self._timed([t.candidate for t in ahead[:half]], size, RUNS) + ahead[half:]
        return [t for t in ahead if not t.misses]

    def _screen(self, candidate: Candidate) -> bool:
        """Return whether a candidate may keep the bounds: its errors on some thousand rays do not
        rule it out. Most bad candidates already fail on PROBE rays.
        """
        trial = self._trial(candidate)
        self.report(f"{candidate}: screening")
        for size in (PROBE, SCREEN):
            finding = self._find(trial, self._rays(size))
            if finding is None:
                return False
            if finding.is_hopeless(self.promise):
                self._reject(trial, finding, f"on {size:,} rays")
                return False
        return True

    def _proved(self, trial: Trial) -> bool:
        for turn, what in ((1, "proof"), (2, "confirmation")):
            self.report(f"{trial.candidate}: {what} on {self.rays:,} rays")
            finding = self._find(trial, self._rays(self.rays, turn))
            if finding is None:
                return False
            if finding.misses(self.promise, trial.texture_bytes):
                self._reject(trial, finding, f"{what} on {self.rays:,} rays")
                return False
        trial.outcome, trial.note = "chosen", f"proved on {2 * self.rays:,} rays"
        return True

    # Parts of the stages --------------------------------------------------------------------

    def _timed(self, candidates: Sequence[Candidate], size: int, runs: int) -> list[Trial]:
        """Return trials of the candidates that can run, timed in alternation, fastest first."""
        known, done = self._rays(size, kinds=self.timed_kinds), []
        ready: list[tuple[Trial, Tracer, list[float]]]
        for at in range(0, len(candidates), WAVE):      # WAVE at a time, to bound the memory
            ready = []
            for candidate in candidates[at:at + WAVE]:
                trial = self._trial(candidate)
                tracer = self._open(trial)
                if tracer is not None:
                    known.trace(tracer)     # warm up: compile the programs
                    ready.append((trial, tracer, []))
            for _ in range(runs):
                for _, tracer, seconds in ready:
                    seconds.append(known.trace(tracer)[1])
            for trial, tracer, seconds in ready:
                trial.rates[size] = size / statistics.median(seconds)
                self._weigh(trial, tracer)
                tracer.release()
                done.append(trial)
        return _fastest(done)

    def _weigh(self, trial: Trial, tracer: Tracer) -> None:
        trial.texture_bytes = bytes_in_flight(tracer)
        most = self.promise.max_bytes
        if most is not None and trial.texture_bytes > most:
            trial.misses = {**trial.misses, "bytes": trial.texture_bytes / most}
            trial.outcome, trial.note = "missed", _missed(trial.misses)

    def _open(self, trial: Trial) -> Tracer | None:
        try:
            return Tracer(self.scene, trial.candidate.method, **dict(trial.candidate.options))
        except (OptionError, LimitError) as failure:    # the options conflict or exceed a limit
            trial.outcome, trial.note = "not possible", " ".join(str(failure).split())
            return None

    def _find(self, trial: Trial, known: KnownRays) -> Finding | None:
        """Return the errors of a trial's candidate on known rays; None if the candidate cannot
        run. Answers with the same bits, which are frequent, are judged only once.
        """
        tracer = self._open(trial)
        if tracer is None:
            return None
        with tracer:
            hits, _ = known.trace(tracer)
            if not trial.rates:
                same = self.timed_kinds == self.promise.kinds
                timed = known if same else self._rays(len(known), kinds=self.timed_kinds)
                timed.trace(tracer)     # warm up: these rays may need other programs
                trial.rates[len(known)] = len(known) / statistics.median(
                    timed.trace(tracer)[1] for _ in range(FEW_RUNS))
                self._weigh(trial, tracer)
        key = _digest(hits, known)
        if key not in self._findings:
            self._findings[key] = Finding.of(known.judge(hits), self.promise.t_quantile)
        trial.finding = self._findings[key]
        return trial.finding

    def _reject(self, trial: Trial, finding: Finding, where: str) -> None:
        trial.misses = finding.misses(self.promise, trial.texture_bytes)
        trial.outcome, trial.note = "missed", f"{_missed(trial.misses)}, {where}"

    def _trial(self, candidate: Candidate) -> Trial:
        return self.trials.setdefault(candidate, Trial(candidate))

    def _rays(self, count: int, turn: int = 0, kinds: tuple[str, ...] | None = None) -> KnownRays:
        """Return known rays of the kinds of the promise, or of ``kinds``. ``turn`` is 0 for the
        search, 1 for the proof and 2 for the confirmation, with different seeds.
        """
        key = (count, turn, self.promise.kinds if kinds is None else kinds)
        if key not in self._known:
            self._known[key] = KnownRays(self.scene, count, 3 * self.seed + turn, key[2])
        return self._known[key]

    def _late(self) -> bool:
        if time.monotonic() < self.deadline:
            return False
        if LATE not in self.notes:
            self._say(LATE)
        return True

    def _say(self, note: str) -> None:
        self.notes.append(note)
        self.report(note)

    def _choice(self, chosen: Trial) -> Choice:
        finding = chosen.finding
        assert finding is not None
        return Choice(
            chosen.candidate.method, chosen.candidate.full_options(), self.promise.to_dict(),
            {"rays": self.rays, "seed": self.seed, "t_error": finding.t_error,
             "wrong": finding.score.wrong, "wrong_share": finding.score.wrong_share,
             "upper_95": finding.score.upper_95, "timed_on": list(self.timed_kinds),
             "rays_per_second": chosen.rays_per_second, "texture_bytes": chosen.texture_bytes})


def _fastest(trials: Sequence[Trial]) -> list[Trial]:
    return sorted(trials, key=lambda t: -t.rays_per_second)


def _missed(misses: dict[str, float]) -> str:
    return ", ".join(f"{name} {ratio:.3g} times its bound" for name, ratio in misses.items())


def _digest(hits: Hits, known: KnownRays) -> bytes:
    digest = hashlib.sha256(f"{known.seed} {len(known)}".encode())
    for array in (hits.t, hits.u, hits.v, hits.triangle, hits.status):
        digest.update(array)
    return digest.digest()
