"""Test that mutated files are read, or refused with a one-line error, within 10 s and 2 GiB each.

    python tools/mutate_files.py KIND COUNT [SEED]     # KIND: `mesh`, `material`, ..., or `all`
    python tools/mutate_files.py KIND 1 SEED --keep FOLDER     # write a case's files to FOLDER.

A case is a small set of files of one kind, with random changes that depend only on its kind and
seed. Cases run in a worker process with limits on memory and time. A case that takes too long,
hangs or kills its worker is reported. A new worker replaces a lost worker.
"""
from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

SECONDS = 10
MEMORY = 2 << 30
OK, REFUSED = "success", "one line"


class Late(BaseException):
    """Ends a case that takes too long."""


def run_case(kind: str, seed: int, folder: Path) -> str:
    """Run a case; return OK, REFUSED, or its fault."""
    from mutating.file_kinds import read_case, write_case

    import gpgpu_rt as rt
    write_case(kind, seed, folder)
    try:
        with _alarm(SECONDS):
            read_case(kind, seed, folder)
        return OK
    except Late:
        return f"takes more than {SECONDS} s"
    except rt.Error as failure:
        line = str(failure)
        if not line or "\n" in line or len(line) > 1000:
            return f"a message of {len(line)} characters: {line[:200]!r}"
        return REFUSED
    except BaseException as failure:
        return f"{type(failure).__name__}: {' '.join(str(failure).split())[:200]}"


@contextlib.contextmanager
def _alarm(seconds: int) -> Iterator[None]:
    def ring(*_: Any) -> None:
        raise Late
    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _work(pipe: Connection, kind: str, first: int, last: int) -> None:
    """Run cases. After each case, send its result, its seconds and the peak memory."""
    os.environ["GPGPU_RT_CACHE"] = ""
    from mutating.file_kinds import cornell
    cornell()       # before the limit is set, because the renderer's own memory does not count
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    with tempfile.TemporaryDirectory() as top:
        for seed in range(first, last):
            folder = Path(top) / str(seed)
            folder.mkdir()
            begun = time.monotonic()
            ended = run_case(kind, seed, folder)
            shutil.rmtree(folder)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            pipe.send((seed, ended, time.monotonic() - begun, peak))


def run_cases(kind: str, count: int, seed: int) -> dict[str, Any]:
    begun, ends, faults = time.monotonic(), Counter[str](), []
    slowest, peak, at = 0.0, 0, seed
    context = multiprocessing.get_context("spawn")
    while at < seed + count:
        mine, its = context.Pipe()
        worker = context.Process(target=_work, args=(its, kind, at, seed + count),
                                 daemon=True)
        worker.start()
        its.close()
        patience = 120.0       # seconds for the start of the worker
        while at < seed + count:
            try:
                told = mine.recv() if mine.poll(patience) else None
            except EOFError:
                told = None
            if told is None:
                worker.kill()
                worker.join()
                faults.append((at, f"killed its process, or hung ({worker.exitcode})"))
                at += 1
                break
            at, patience = told[0] + 1, SECONDS + 20.0
            slowest, peak = max(slowest, told[2]), max(peak, told[3])
            ends[told[1] if told[1] in (OK, REFUSED) else "fault"] += 1
            if told[1] not in (OK, REFUSED):
                faults.append((told[0], told[1]))
        worker.join()
    return {"kind": kind, "count": count, "seed": seed, **ends, "faults": faults,
            "slowest_seconds": round(slowest, 2), "peak_mib": peak >> 20,
            "seconds": round(time.monotonic() - begun, 1)}


def main() -> int:
    from mutating.file_kinds import KINDS, write_case
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=[*KINDS, "all"])
    parser.add_argument("count", type=int)
    parser.add_argument("seed", type=int, nargs="?", default=0)
    parser.add_argument("--keep", type=Path, metavar="FOLDER",
                        help="write the files of the case SEED to this folder, and read nothing")
    chosen = parser.parse_args()
    if chosen.keep:
        chosen.keep.mkdir(exist_ok=True)
        write_case(chosen.kind, chosen.seed, chosen.keep)
        return 0
    failed = False
    for kind in KINDS if chosen.kind == "all" else [chosen.kind]:
        found = run_cases(kind, chosen.count, chosen.seed)
        failed |= bool(found["faults"])
        for seed, what in found.pop("faults"):
            print(f"{kind} {seed}: {what}")
        print(json.dumps(found), flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
