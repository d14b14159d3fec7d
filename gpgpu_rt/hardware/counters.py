"""Counters: operations, fetches and bytes of logged passes, from their compiled programs.

The program alone determines the work of a fragment outside loops. It does not determine the number
of loop iterations, so `counted` emulates fragments of every draw of a program with loops.
"""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import OptionError
from ..gl.pass_log import PassLog, logged
from ..statistics import Statistics
from ..tracer import Tracer
from .compiler import check_countable
from .loop_counts import Turned, Turns
from .program import Program, RegionWork
from .sample import programs_of


def counted(tracer: Tracer, call: Callable[[], Any]) -> tuple[list[dict[str, Any]], PassLog]:
    """Count the work of the passes of a call, in the same programs that are timed.

    Parameters
    ----------
    tracer : a tracer without the option ``statistics``. The programs of a tracer with statistics
        have further instructions, which would be counted, too
    call : the call to count, such as ``lambda: tracer.trace(origins, directions)``

    Returns
    -------
    (passes, log)
        the entries of `pass_counts`, in which ``total`` includes the iterations of loops; and the
        log, which also has queries, uploads and readbacks

    Raises
    ------
    NotCountable
        if this machine's Mesa does not print the instructions of programs
    OptionError
        for a tracer with statistics
    """
    if tracer.options["statistics"]:
        raise OptionError("with statistics=True, or within counting, the work of the counters "
                          "would be counted, too; leave statistics out")
    check_countable()
    turns = Turns()
    with tracer.gpu, logged(tracer.gpu, Statistics()) as log, tracer.gpu.observed(turns):
        call()
    return pass_counts(log, turns), log


def pass_counts(log: PassLog, turns: Turns | None = None) -> list[dict[str, Any]]:
    """Return the passes of a log with the work of their fragments.

    Returns
    -------
    list of dict
        the entries of the log with further keys. Work is given as ``vector`` and ``scalar``
        instructions and ``fetches`` by texture. ``once`` is the work of a fragment outside loops,
        including both sides of branches. ``loops`` is a list: the work that an iteration of each
        loop adds, without inner loops. ``total`` is the work of all fragments, including both
        sides of branches. ``tables_read`` is the number of bytes fetched from tables.

        For a program with loops, ``total`` is present only if ``turns`` has counted all its draws.
        Then ``wanted`` has the fetches without the sides of branches that no fragment executed,
        and ``emulated`` is the number of emulated fragments
    """
    entries = log.to_list()
    keys, works = list(log.passes), list(log.passes.values())
    for entry, key, program in zip(entries, keys, programs_of([one.texts for one in works])):
        once = program.flattened(0)
        entry["once"] = _plain(once)
        entry["loops"] = [_plain(program.flattened(loop)) for loop in program.loops]
        turned = turns.found.get(key) if turns else None
        if not program.loops:
            entry["total"] = _plain(once, entry["fragments"])
        elif turned is not None and _all_of(turned, entry["fragments"], program):
            entry["total"] = _plain(turned.work)
            entry["wanted"], entry["emulated"] = dict(turned.fetches), turned.emulated
        if "total" in entry:
            fetched = entry.get("wanted", entry["total"]["fetches"])
            entry["tables_read"] = sum(count * entry["texel_bytes"][name]
                                       for name, count in fetched.items()
                                       if name.endswith("_table"))
    return entries


def _all_of(turned: Turned, fragments: int, program: Program) -> bool:
    """Return whether the emulated draws represent the fragments that ran.

    The log counts the fragments that were written, which may be fewer than the draws covered. If a
    mask removed fragments before they ran, the emulation has counted too much, and the result is
    false. If the program itself discards fragments, they did run, and the result is true.
    """
    discards = any(one.op == "discard_if" for one in program.instructions())
    return turned.fragments == fragments or (discards and turned.fragments > fragments)


def _plain(work: RegionWork, times: int = 1) -> dict[str, Any]:
    return {"vector": times * work.vector, "scalar": times * work.scalar,
            "fetches": {name: times * count for name, count in work.fetches.items()}}
