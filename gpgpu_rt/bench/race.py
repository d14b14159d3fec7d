"""The race: methods and engines take turns at the same rays, and ratios are taken turn by turn."""
from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from typing import Any

from ..errors import OptionError
from ..options import spell
from ..text_format import counted
from ..tracer import Tracer
from .engines import EMBREE, ENGINES, Engine
from .work import Work, work_of
from .workloads import Workload, load, told, workload

NOISY = 1.5    # slowest over fastest run of the yardstick, above which nothing is concluded


@dataclass
class Entry:
    """One that runs: a method with its options, or an engine.

    Attributes
    ----------
    name, options : of the method; of an engine, its name and nothing
    rays : how many it traced a turn
    out_of : of how many, where it was given a part of them; else None
    seconds : of each turn, passes alone, and what the host took to put rays in order; of an
        engine, its call
    wall_seconds : of each turn, numpy arrays in to numpy arrays out
    over : by turn, its rate over the yardstick's in that turn
    over_wall : the same from arrays to arrays
    bytes_a_triangle : what a method's tables take
    work : of a method, what it does for a ray, by a sample
    """

    name: str
    options: dict[str, Any]
    rays: int
    seconds: list[float] = field(default_factory=list)
    wall_seconds: list[float] = field(default_factory=list)
    over: list[float] = field(default_factory=list)
    over_wall: list[float] = field(default_factory=list)
    bytes_a_triangle: float | None = None
    work: Work | None = None
    out_of: int | None = None

    @property
    def title(self) -> str:
        """Its name, and how few rays it traced where the others traced more."""
        return self.name if self.out_of is None else (
            f"{self.name}, {self.rays:,} of {self.out_of:,} rays")

    @property
    def words(self) -> str:
        """Its options, such as "octants packet=4x2"; "" without any."""
        return " ".join(name if value is True else f"{name}={spell(value)}"
                        for name, value in self.options.items())

    @property
    def label(self) -> str:
        """Title and options together."""
        return f"{self.title} {self.words}".rstrip()

    @property
    def rays_per_second(self) -> float:
        """By the median turn, passes alone."""
        return self.rays / statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """Slowest over fastest turn."""
        return max(self.seconds) / min(self.seconds)

    def verdict(self) -> str:
        """What all turns agree on."""
        if not self.over or self.name == EMBREE:
            return ""
        if min(self.over) > 1:
            return "faster"
        return "slower" if max(self.over) < 1 else "not told apart"

    def to_dict(self) -> dict[str, Any]:
        found = {**asdict(self), "work": self.work and self.work.to_dict(),
                 "rays_per_second": self.rays_per_second, "spread": self.spread}
        for name, turns in (("over_embree", self.over), ("over_embree_wall", self.over_wall)):
            if turns:
                found[name] = statistics.median(turns)
        return found


def ranked(entries: Sequence[Entry]) -> list[Entry]:
    """The fastest first: by the ratio over embreex, as the verdict is by its turns, or without one
    by the rate. The two may differ, for a busy moment slows one turn of everyone's."""
    return sorted(entries, key=lambda entry: -(
        statistics.median(entry.over) if entry.over else entry.rays_per_second))


def race(scene: str, kind: str, candidates: Sequence[tuple[str, dict[str, Any]]],
         size: int = 1024, runs: int = 5, engines: Sequence[Engine] = ENGINES,
         report: Callable[[str], None] = lambda line: None) -> list[Entry]:
    """Let candidates and engines trace the same rays, turn after turn.

    Parameters
    ----------
    scene : a scene's name or a mesh file
    kind : what `workload` knows: ``eye rays``, ``shadow rays``, ``mirror rays 1``, ...
    candidates : (method, options) each
    size : pixels a side of the image that the rays belong to
    runs : timed turns, after one warm-up; in each, everyone traces once more before it is timed,
        as the one before left its own data in the caches
    engines : those that are missing, or not made for these rays, are left out
    report : told of the progress, a line at a time

    Returns
    -------
    list of Entry
        candidates, then engines, in the order given. Ratios are over embreex on one thread and
        need it.
    """
    if runs < 1:
        raise OptionError(f"{runs} runs tell nothing; give 1 or more")
    if size < 1:
        raise OptionError(f"{size} pixels a side are no image; give 1 or more")
    if not len(load(scene)):
        raise OptionError(f"{scene} has no triangles to race on; give a scene with some")
    rays, what = workload(scene, kind, size), f"{scene}, {told(kind)}"
    if not rays.live:
        raise OptionError(f"{scene} has no {told(kind)} at {size} x {size} pixels; "
                          "choose other rays or a larger size")
    report(f"{what}: building for {counted(len(candidates), 'candidate')}")
    entries, calls, opened = [], [], []
    with ExitStack() as tracers:
        for name, options in candidates:
            tracer = tracers.enter_context(Tracer(load(scene), name, **options))
            entries.append(Entry(name, options, rays.live, bytes_a_triangle=sum(
                tracer.statistics.table_bytes.values()) / len(load(scene))))
            calls.append(_ours(tracer, rays))
            opened.append(tracer)
        for engine in engines:
            if engine.missing:
                continue
            if rays.t_max is not None and not engine.ends:
                report(f"{what}: without {engine.name}, whose rays have no end")
            else:
                given = rays.compact(engine.most)
                entries.append(Entry(engine.name, {}, given.live, out_of=(
                    rays.live if given.live < rays.live else None)))
                calls.append(_theirs(engine.prepare(load(scene), given)))
        for turn in range(runs + 1):   # the first one warms up
            report(f"{what}: " + (f"run {turn} of {runs}" if turn else "warm-up"))
            times = [[call() for _ in range(2 if turn else 1)] for call in calls]
            if turn:
                _note(entries, [last for *_, last in times])
        for entry, tracer in zip(entries, opened):     # the candidates come first
            report(f"{what}: counting the work of {entry.label}")
            entry.work = work_of(tracer, rays)
    return entries


def _ours(tracer: Tracer, rays: Workload) -> Callable[[], tuple[float, float]]:
    def call() -> tuple[float, float]:
        began = time.perf_counter()
        rays.trace(tracer)
        return tracer.statistics.trace_seconds, time.perf_counter() - began
    return call


def _theirs(run: Callable[[], Any]) -> Callable[[], tuple[float, float]]:
    def call() -> tuple[float, float]:
        began = time.perf_counter()
        run()
        took = time.perf_counter() - began
        return took, took
    return call


def _note(entries: Sequence[Entry], times: Sequence[tuple[float, float]]) -> None:
    """Keep a turn's times, and the ratios to the yardstick in that turn."""
    by_ray = next((seconds / entry.rays for entry, (seconds, _) in zip(entries, times)
                   if entry.name == EMBREE), None)
    for entry, (seconds, wall) in zip(entries, times):
        entry.seconds.append(seconds)
        entry.wall_seconds.append(wall)
        if by_ray is not None:
            entry.over.append(by_ray * entry.rays / seconds)
            entry.over_wall.append(by_ray * entry.rays / wall)


def too_noisy(entries: Sequence[Entry]) -> str:
    """Why nothing is to be concluded, or ""."""
    for entry in entries:
        if entry.name == EMBREE:
            if len(entry.seconds) < 3:
                return f"{counted(len(entry.seconds), 'run')} cannot tell; give 3 or more"
            if entry.spread > NOISY:
                return (f"the slowest run of {EMBREE} took {entry.spread:.2f} times the fastest: "
                        "this machine is too busy for a verdict; try again when it is idle")
            return ""
    return "embreex did not run: there is nothing to compare with"
