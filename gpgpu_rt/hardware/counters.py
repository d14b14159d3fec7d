"""Operations and fetches of logged passes, from their compiled programs."""
from __future__ import annotations

from typing import Any

from ..passes.pass_log import PassLog
from .compiler import compiled
from .program import Program, Work, parse


def pass_counts(log: PassLog) -> list[dict[str, Any]]:
    """The passes of a log with what each fragment of them does.

    Returns
    -------
    list of dict
        the log's entries, and in each ``once``, what a fragment does outside loops, both sides of
        branches, and ``loops``, what a turn of each loop adds (its inner loops left out):
        ``vector`` and ``scalar`` instructions, ``fetches`` by texture. Where there is no loop,
        ``total`` is ``once`` times the fragments.
    """
    entries, works = log.to_list(), list(log.passes.values())
    for entry, program in zip(entries, map(parse, compiled([one.texts for one in works]))):
        once = program.flattened(0)
        entry["once"] = _plain(once)
        entry["loops"] = [_plain(program.flattened(loop)) for loop in program.loops]
        if not program.loops:
            entry["total"] = _plain(once, entry["fragments"])
    return entries


def _plain(work: Work, times: int = 1) -> dict[str, Any]:
    return {"vector": times * work.vector, "scalar": times * work.scalar,
            "fetches": {name: times * count for name, count in work.fetches.items()}}


def modelled(program: Program, rays: int, kernel_runs: list[int]) -> Work:
    """The static model of a traversal in one loop: what rays do that run each kernel so often.

    The loop program nests one loop a kernel in an outer one, in the order of the kernels' phases.
    How often the outer one turns is not known from counters: as often as the kernel that runs
    least is taken. Both sides of branches count, as a machine without branches runs them.
    """
    total = _times(program.flattened(0), rays)
    outer, *inner = program.loops
    for region, runs in zip([outer, *inner], [max(rays, min(kernel_runs)), *kernel_runs]):
        total = total + _times(program.flattened(region), runs)
    return total


def _times(work: Work, count: int) -> Work:
    found = Work(count * work.vector, count * work.scalar)
    found.fetches.update({name: count * fetches for name, fetches in work.fetches.items()})
    return found
