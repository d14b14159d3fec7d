"""Interrupts: Ctrl-C ends a command with status 130 and no traceback, whenever it comes.

Imports little: a command installs the handler first, and loads the libraries then.
"""
from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from _thread import start_new_thread
from collections.abc import Callable, Iterator
from types import FrameType

STATUS = 130        # what a shell makes of a command that Ctrl-C ended
RETRY = 0.01        # seconds until an interrupt that was deferred comes again

Command = Callable[[], int]


def run(load: Callable[[], Command], also: tuple[int, ...] = ()) -> int:
    """Load a command, run it, and return its exit status.

    Parameters
    ----------
    load : imports the command's libraries and returns the command. An interrupt meanwhile ends the
        process at once: nothing is written yet, and libraries catch exceptions as they are loaded
    also : signals besides SIGINT that interrupt

    Notes
    -----
    Within the command an interrupt is a ``KeyboardInterrupt``, as ever. A process that was started
    with SIGINT ignored, as by ``nohup`` or ``&``, goes on ignoring it.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        for number in (signal.SIGINT, *also):
            signal.signal(number, _interrupted)
        sys.unraisablehook = _not_raised
    command = load()
    try:
        return _run(command)
    except KeyboardInterrupt:
        return STATUS


def _run(command: Command) -> int:
    """Run the command: a frame by which the handler knows that the command is running."""
    return command()


def _interrupted(number: int, frame: FrameType | None) -> None:
    importing = False
    while frame is not None and frame.f_code is not _run.__code__:
        importing = importing or frame.f_code.co_filename.startswith("<frozen importlib")
        frame = frame.f_back
    if frame is None:       # before the command, or behind it
        os._exit(STATUS)
    if importing:       # libraries catch everything around their optional imports
        return _again(number)
    raise KeyboardInterrupt


def _again(number: int) -> None:
    """Send this process the signal once more, soon."""
    # A Thread object would take a lock, which the interrupted code may hold.
    start_new_thread(_send, (number,))


def _send(number: int) -> None:
    time.sleep(RETRY)
    os.kill(os.getpid(), number)


def _not_raised(problem: sys.UnraisableHookArgs) -> None:
    """Interrupt again where the exception was lost, as in ``__del__``, instead of printing it."""
    if issubclass(problem.exc_type, KeyboardInterrupt):
        _again(signal.SIGINT)
    else:
        sys.__unraisablehook__(problem)


@contextlib.contextmanager
def left_to_this_process() -> Iterator[None]:
    """Within, processes that this thread starts ignore Ctrl-C, which a terminal sends them too.

    So do the processes of threads that this thread starts within. The signal is blocked and not
    ignored: this process has threads besides, which receive it.
    """
    from multiprocessing import resource_tracker
    resource_tracker.ensure_running()       # starting it would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
