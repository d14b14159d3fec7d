"""Runner: traces cases in a separate process, so that an engine may crash or hang."""
from __future__ import annotations

import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

from ..errors import Error
from ..interrupts import left_to_this_process
from .answers import EngineAnswers, Trace
from .case import Case
from .spec import Spec

START_SECONDS = 120
SECONDS = 300       # an engine that needs more time for a case counts as crashed
MOST_WORDS = 300    # number of bytes shown of an engine's last error text
NO_ANSWER = "no answer"


class Crash(Exception):
    """An engine raised an exception, ended its process, or gave no answer in time."""


class Runner:
    """Runs engines in another process. After a crash or a timeout, the next call starts a new
    process."""

    def __init__(self, seconds: float = SECONDS) -> None:
        self.seconds = seconds
        self._process: multiprocessing.process.BaseProcess | None = None
        self._ours: Connection | None = None
        self._errors: Any = None    # file for the engine's stderr

    def load(self, spec: Spec) -> None:
        """Load the engine, but trace no case.

        Raises
        ------
        Crash
            with the reason, in one line
        """
        self._ask(spec, None)

    def trace(self, spec: Spec, case: Case) -> tuple[EngineAnswers, float]:
        """Return the engine's answers, and the seconds of its call.

        Raises
        ------
        Crash
            with the reason, in one line
        """
        return self._ask(spec, case)

    def _ask(self, spec: Spec, case: Case | None) -> tuple[EngineAnswers, float]:
        if self._process is None or not self._process.is_alive():
            self._start()
        assert self._ours is not None and self._process is not None
        try:
            self._ours.send((spec, case))
            if not self._ours.poll(self.seconds):
                self.close()
                raise Crash(f"{NO_ANSWER} within {self.seconds:g} s")
            answers, seconds, failure = self._ours.recv()
        except (EOFError, OSError):
            self._process.join(5)
            reason = f"the process ended with status {self._process.exitcode}"
            last = self._last_words()
            self.close()
            raise Crash(f"{reason}: {last}" if last else reason) from None
        if failure:
            raise Crash(failure)
        return answers, seconds

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._ours, theirs = context.Pipe()
        self._errors = tempfile.NamedTemporaryFile(prefix="gpgpu_rt-errors-")
        self._process = context.Process(target=_serve, args=(theirs, self._errors.name))
        with left_to_this_process():
            self._process.start()
        theirs.close()
        try:
            if self._ours.poll(START_SECONDS):
                self._ours.recv()
                return
        except (EOFError, OSError):
            pass
        self.close()
        raise Error("another process of Python did not start; a script needs the line `if "
                    "__name__ == \"__main__\":` above the lines that call the suite")

    def _last_words(self) -> str:
        """Return the engine's last line on stderr, such as a C library's error."""
        self._errors.seek(max(0, os.stat(self._errors.name).st_size - MOST_WORDS))
        lines = self._errors.read().decode(errors="replace").splitlines()
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._ours is not None:
            self._ours.close()
        if self._errors is not None:
            self._errors.close()
        self._process = self._ours = self._errors = None

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def _serve(theirs: Connection, errors: str) -> None:
    """Answer cases until the other process closes the pipe. ``errors`` is the file for stderr."""
    loaded: dict[Spec, Trace] = {}
    theirs.send("ready")
    while True:
        try:
            spec, case = theirs.recv()
        except (EOFError, KeyboardInterrupt):
            return
        answers, failure, began = None, "", time.perf_counter()
        try:
            with _silent(errors):
                if case is None:
                    spec.load()
                else:
                    if spec not in loaded:
                        found = spec.load()
                        found(case)     # the first call may compile
                        loaded[spec] = found
                    began = time.perf_counter()
                    answers = loaded[spec](case)
        except BaseException as problem:    # an engine may raise anything
            if isinstance(problem, KeyboardInterrupt):
                return
            failure = f"{type(problem).__name__}: {' '.join(str(problem).split())[:300]}"
        theirs.send((answers, time.perf_counter() - began, failure))


@contextmanager
def _silent(errors: str) -> Iterator[None]:
    """Discard the output of engines and their C code; stderr goes to the file ``errors``."""
    kept = [os.dup(1), os.dup(2)]
    files = [os.open(os.devnull, os.O_WRONLY), os.open(errors, os.O_WRONLY | os.O_TRUNC)]
    try:
        for stream, file in zip((1, 2), files):
            os.dup2(file, stream)
        yield
    finally:
        for stream, old in zip((1, 2), kept):
            os.dup2(old, stream)
            os.close(old)
        for file in files:
            os.close(file)
