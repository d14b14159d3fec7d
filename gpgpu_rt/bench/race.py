"""The race: methods and engines trace the same rays in turn, and each turn gives its ratios."""
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

NOISY = 1.5    # no verdict if the baseline's slowest run took more than this times its fastest


@dataclass
class Entry:
    """An entry of a race: a method with its options, or an engine.

    Attributes
    ----------
    name, options : the method and its options; an engine has no options
    rays : number of rays traced per turn
    seconds : time of each turn; for a method the passes and the host's sorting of rays, for an
        engine its call
    wall_seconds : time of each turn from numpy arrays to numpy arrays
    over : rate over the baseline's rate, turn by turn
    over_wall : the same ratio of the rates from arrays to arrays
    bytes_a_triangle : size of a method's tables over the number of triangles
    work : the work of a method per ray, measured on a sample
    out_of : number of rays of the race if the entry traced only a part of them; else None
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
        """The name, with the number of rays if the entry traced only a part of them."""
        return self.name if self.out_of is None else (
            f"{self.name}, {self.rays:,} of {self.out_of:,} rays")

    @property
    def words(self) -> str:
        """The options as text, such as "octants packet=4x2"; "" without options."""
        return " ".join(name if value is True else f"{name}={spell(value)}"
                        for name, value in self.options.items())

    @property
    def label(self) -> str:
        """The title and the options."""
        return f"{self.title} {self.words}".rstrip()

    @property
    def rays_per_second(self) -> float:
        """The rate of the median turn, by ``seconds``."""
        return self.rays / statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """The time of the slowest turn over the fastest."""
        return max(self.seconds) / min(self.seconds)

    def verdict(self) -> str:
        """Return the comparison with the baseline on which all turns agree."""
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
    """Return the entries in order of speed, the fastest first.

    The order follows the median ratio over embreex, on whose turns the verdict is based, or the
    rate without embreex. The two orders may differ, because a busy moment of the machine slows all
    entries in the same turn.
    """
    return sorted(entries, key=lambda entry: -(
        statistics.median(entry.over) if entry.over else entry.rays_per_second))


def race(scene: str, kind: str, candidates: Sequence[tuple[str, dict[str, Any]]],
         size: int = 1024, runs: int = 5, engines: Sequence[Engine] = ENGINES,
         report: Callable[[str], None] = lambda line: None) -> list[Entry]:
    """Time candidates and engines on the same rays, turn after turn.

    Parameters
    ----------
    scene : a scene's name or a mesh file
    kind : a name for `workload`: ``eye rays``, ``shadow rays``, ``mirror rays 1``, ...
    candidates : (method, options) each
    size : side in pixels of the square image that the rays belong to
    runs : number of timed turns, after a warm-up turn. In a timed turn, each entry first traces
        once untimed, because the entry before it filled the caches with other data
    engines : engines to time; missing engines, and engines that cannot trace these rays, are left
        out
    report : called with each line about progress

    Returns
    -------
    list of Entry
        candidates, then engines, in the given order. Ratios are over embreex on one thread;
        without embreex there are none.

    Raises
    ------
    OptionError
        for an empty scene, a scene without rays of this kind, or ``runs`` or ``size`` below 1
    """
    if runs < 1:
        raise OptionError(f"{runs} runs cannot measure anything; give 1 or more")
    if size < 1:
        raise OptionError(f"an image cannot have {size} pixels per side; give 1 or more")
    if not len(load(scene)):
        raise OptionError(f"{scene} has no triangles to trace; give another scene")
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
                report(f"{what}: left out {engine.name}, whose rays cannot have an end")
            else:
                given = rays.compact(engine.most)
                entries.append(Entry(engine.name, {}, given.live, out_of=(
                    rays.live if given.live < rays.live else None)))
                calls.append(_theirs(engine.prepare(load(scene), given)))
        for turn in range(runs + 1):   # the first turn is the warm-up
            report(f"{what}: " + (f"run {turn} of {runs}" if turn else "warm-up"))
            times = [[call() for _ in range(2 if turn else 1)] for call in calls]
            if turn:
                _note(entries, [last for *_, last in times])
        for entry, tracer in zip(entries, opened):     # the candidates come first
            report(f"{what}: measuring the work per ray of {entry.label}")
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
    """Store the times of a turn, and its ratios over the baseline."""
    by_ray = next((seconds / entry.rays for entry, (seconds, _) in zip(entries, times)
                   if entry.name == EMBREE), None)
    for entry, (seconds, wall) in zip(entries, times):
        entry.seconds.append(seconds)
        entry.wall_seconds.append(wall)
        if by_ray is not None:
            entry.over.append(by_ray * entry.rays / seconds)
            entry.over_wall.append(by_ray * entry.rays / wall)


def too_noisy(entries: Sequence[Entry]) -> str:
    """Return the reason why the times allow no verdict, or ""."""
    for entry in entries:
        if entry.name == EMBREE:
            if len(entry.seconds) < 3:
                return f"{counted(len(entry.seconds), 'run')} cannot decide; give 3 or more"
            if entry.spread > NOISY:
                return (f"the slowest run of {EMBREE} took {entry.spread:.2f} times the fastest: "
                        "this machine is too busy for a verdict; try again when it is idle")
            return ""
    return "embreex did not run: there is nothing to compare with"
