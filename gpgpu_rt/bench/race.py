"""The race: methods and engines trace the same rays, one after another, in several rounds.

An entry is a method or an engine. Each round gives the ratio of every entry's rate to embreex's
rate. A busy machine slows all entries of a round, so these ratios vary less than the rates.
"""
from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..errors import OptionError
from ..options import spell
from ..text_format import counted
from ..tracer import Tracer
from .engines import EMBREE, ENGINES, Engine
from .workloads import Workload, load, told, workload

# Times are uncertain if the slowest run took more than this many times as long as the fastest. If
# embreex's times are uncertain, there is no verdict.
NOISY = 1.5
WORK = ("nodes_visited", "leaves_visited", "triangles_tested")      # the counters of `Entry.work`


@dataclass
class Entry:
    """An entry of a race: a method with its options, or an engine.

    Attributes
    ----------
    name, options : The method and its options; an engine has no options.
    rays : Number of rays that the entry traces in a round.
    seconds : Time in each round. For a method, the time of its passes and of sorting rays on the
        host; for an engine, the time of its call.
    wall_seconds : Time in each round, from rays in numpy arrays to hits in numpy arrays.
    over : For each round, the entry's rate, computed from ``seconds``, divided by the rate of the
        baseline, embreex on one thread.
    over_wall : As ``over``, but with the entry's rate computed from ``wall_seconds``.
    bytes_a_triangle : Size of a method's tables, divided by the number of triangles.
    work : Name of a counter -> its value per ray; empty if the race counts no work. Each ray of a
        packet gets an equal share of the packet's value.
    out_of : Number of rays of the race, if the entry traced only some of these rays; else None.
    all_options : The options of the method's tracer, with defaults; empty for an engine.
        ``statistics`` is true if the race counts work, although the timed programs count nothing.
    """

    name: str
    options: dict[str, Any]
    rays: int
    seconds: list[float] = field(default_factory=list)
    wall_seconds: list[float] = field(default_factory=list)
    over: list[float] = field(default_factory=list)
    over_wall: list[float] = field(default_factory=list)
    bytes_a_triangle: float | None = None
    work: dict[str, float] = field(default_factory=dict)
    out_of: int | None = None
    all_options: dict[str, Any] = field(default_factory=dict)

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
        """The number of rays divided by the median of ``seconds``."""
        return self.rays / statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """The time of the slowest round, divided by the time of the fastest."""
        return max(self.seconds) / min(self.seconds)

    def verdict(self) -> str:
        """Return "faster" or "slower" if the entry beats or trails the baseline in every round,
        else "not told apart"; "" for the baseline, or if the baseline did not run.
        """
        if not self.over or self.name == EMBREE:
            return ""
        if min(self.over) > 1:
            return "faster"
        return "slower" if max(self.over) < 1 else "not told apart"

    def to_dict(self) -> dict[str, Any]:
        q1, median, q3 = map(float, np.quantile(self.seconds, (0.25, 0.5, 0.75))
                             * 1e9 / self.rays)
        found = {**asdict(self), "rays_per_second": self.rays_per_second,
                 "rays_per_second_q1": 1e9 / q3, "rays_per_second_q3": 1e9 / q1,
                 "spread": self.spread,
                 "ns_per_ray": median, "ns_per_ray_q1": q1, "ns_per_ray_q3": q3}
        for name, turns in (("over_embree", self.over), ("over_embree_wall", self.over_wall)):
            if turns:
                found[name] = statistics.median(turns)
        return found


def ranked(entries: Sequence[Entry]) -> list[Entry]:
    """Return the entries in order of speed, the fastest first.

    The order follows the median ratio to embreex's rate; without embreex, the order follows the
    rate.
    """
    return sorted(entries, key=lambda entry: -(
        statistics.median(entry.over) if entry.over else entry.rays_per_second))


def race(scene: str, kind: str, candidates: Sequence[tuple[str, dict[str, Any]]],
         size: int = 1024, runs: int = 5, engines: Sequence[Engine] = ENGINES,
         report: Callable[[str], None] = lambda line: None, count: bool = False) -> list[Entry]:
    """Time candidates and engines on the same rays, in several rounds.

    Parameters
    ----------
    scene : a scene's name or a mesh file
    kind : a name for `workload`: ``eye rays``, ``shadow rays``, ``mirror rays 1``, ...
    candidates : pairs (method, options)
    size : side in pixels of the square image that the rays belong to
    runs : number of timed rounds, after a warm-up round. In a timed round, each entry first traces
        once untimed, because the previous entry filled the caches
    engines : engines to time; missing engines, and engines that cannot trace the rays, are left
        out
    report : called with each line about progress
    count : before the warm-up, trace once with programs that count the candidates' work

    Returns
    -------
    list of Entry
        candidates, then engines, in the given order. Without embreex, ``over`` and ``over_wall``
        are empty.

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
    entries, calls = [], []
    with ExitStack() as tracers:
        for name, options in candidates:
            tracer = tracers.enter_context(Tracer(load(scene), name, **options))
            table_bytes = sum(tracer.statistics.table_bytes.values())
            entries.append(Entry(name, options, rays.live, all_options=tracer.options,
                                 bytes_a_triangle=table_bytes / len(load(scene))))
            if count:
                entries[-1].work = _work(tracer, rays, options)
                entries[-1].all_options = {**tracer.options, "statistics": True}
            calls.append(_ours(tracer, rays))
        for engine in engines:
            if engine.missing:
                continue
            if rays.t_max is not None and not engine.ends:
                report(f"{what}: left out {engine.name}, whose rays cannot have an end")
            else:
                given = rays.compact(engine.most, engine.tile)
                entries.append(Entry(engine.name, {}, given.live, out_of=(
                    rays.live if given.live < rays.live else None)))
                calls.append(_theirs(engine.prepare(load(scene), given)))
        for turn in range(runs + 1):   # the first round is the warm-up
            report(f"{what}: " + (f"run {turn} of {runs}" if turn else "warm-up"))
            times = [[call() for _ in range(2 if turn else 1)] for call in calls]
            if turn:
                _note(entries, [last for *_, last in times])
    return entries


def _work(tracer: Tracer, rays: Workload, options: dict[str, Any]) -> dict[str, float]:
    """Trace the rays with programs that count their work, and return `Entry.work`."""
    with tracer.counting():
        rays.trace(tracer)
        means = tracer.statistics.counters
    # The means include pixels without a ray. Each ray of a packet has the counts of the whole
    # packet (drivers/packet_hits.frag).
    shared = math.prod(tracer.method.resolved(options)["packet"]) if tracer.method.packet else 1
    return {name: means[name] * len(rays.origins) / (rays.live * shared) for name in WORK}


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
    """Store the times of a round, and the ratios of its rates to the baseline's rate."""
    by_ray = next((seconds / entry.rays for entry, (seconds, _) in zip(entries, times)
                   if entry.name == EMBREE), None)
    for entry, (seconds, wall) in zip(entries, times):
        entry.seconds.append(seconds)
        entry.wall_seconds.append(wall)
        if by_ray is not None:
            entry.over.append(by_ray * entry.rays / seconds)
            entry.over_wall.append(by_ray * entry.rays / wall)


def too_noisy(entries: Sequence[Entry]) -> str:
    """Return the reason why the times allow no verdict; "" if they allow a verdict."""
    for entry in entries:
        if entry.name == EMBREE:
            if len(entry.seconds) < 3:
                return f"{counted(len(entry.seconds), 'run')} cannot decide; give 3 or more"
            if entry.spread > NOISY:
                return (f"the slowest run of {EMBREE} took {entry.spread:.2f} times the fastest: "
                        "this machine is too busy for a verdict; try again when it is idle")
            return ""
    return "embreex did not run: there is nothing to compare with"


def uncertain(entries: Sequence[Entry]) -> list[Entry]:
    """Return the entries whose spread is too large for a comparison of rates."""
    return [entry for entry in entries if entry.spread > NOISY]
