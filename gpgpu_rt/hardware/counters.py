"""Operations, fetches and bytes of logged passes, from their compiled programs.

What a fragment does outside loops follows from the program alone. How often loops turn does not:
`counted` emulates fragments of every draw of a program that has some (``turns``).
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
from .program import Program, Work
from .sample import programs_of


def counted(tracer: Tracer, call: Callable[[], Any]) -> tuple[list[dict[str, Any]], PassLog]:
    """What the passes of a call do, by the programs that time is measured of.

    Parameters
    ----------
    tracer : without statistics, which are instructions too
    call : what is counted: ``lambda: tracer.trace(origins, directions)``

    Returns
    -------
    (passes, log)
        the entries of `pass_counts` with ``total`` of loops too; the log has queries, uploads and
        readbacks

    Raises
    ------
    NotCountable
        where this machine's Mesa does not say what a program compiles to
    """
    if tracer.options["statistics"]:
        raise OptionError("with statistics=True, or within counting, the counters' own work would "
                          "be counted too; leave that out")
    check_countable()
    turns = Turns()
    with tracer.gpu, logged(tracer.gpu, Statistics()) as log, tracer.gpu.watched(turns):
        call()
    return pass_counts(log, turns), log


def pass_counts(log: PassLog, turns: Turns | None = None) -> list[dict[str, Any]]:
    """The passes of a log with what each fragment of them does.

    Returns
    -------
    list of dict
        the log's entries, and in each ``once``, what a fragment does outside loops, both sides of
        branches, and ``loops``, what a turn of each loop adds (its inner loops left out):
        ``vector`` and ``scalar`` instructions, ``fetches`` by texture. ``total`` is that of all
        fragments, both sides of branches; of a program that loops it is there if ``turns`` saw
        all its draws, and then ``wanted`` are the fetches without the sides that no fragment
        took. ``tables_read``: bytes of those fetches that are of tables.
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
    """Whether the fragments seen are those that ran: a mask leaves some out, and so, of what the
    log counts, does a program that discards."""
    discards = any(one.op == "discard_if" for one in program.instructions())
    return turned.fragments == fragments or (discards and turned.fragments > fragments)


def _plain(work: Work, times: int = 1) -> dict[str, Any]:
    return {"vector": times * work.vector, "scalar": times * work.scalar,
            "fetches": {name: times * count for name, count in work.fetches.items()}}
