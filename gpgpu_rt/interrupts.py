"""Interrupts: Ctrl-C ends a command with status 130 and no traceback, at any moment.

The module imports little, because a command installs the handler before it loads the libraries.
"""
from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from _thread import start_new_thread
from collections.abc import Callable, Iterator
from types import FrameType

STATUS = 130        # a shell reports this exit status for a command that Ctrl-C ended
RETRY = 0.01        # seconds until a deferred interrupt is sent again

Command = Callable[[], int]


def run(load: Callable[[], Command], also: tuple[int, ...] = ()) -> int:
    """Load a command, run it, and return its exit status.

    Parameters
    ----------
    load : imports the command's libraries and returns the command. An interrupt during the import
        ends the process, because a library might catch an exception
    also : further signals that interrupt the command as SIGINT does

    Notes
    -----
    Within the command an interrupt is a ``KeyboardInterrupt``. A process that was started with
    SIGINT ignored (``&`` in a script) keeps ignoring SIGINT.
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
    """Run the command. The interrupt handler looks for this function's frame on the stack."""
    return command()


def _interrupted(number: int, frame: FrameType | None) -> None:
    importing = False
    while frame is not None and frame.f_code is not _run.__code__:
        importing = importing or frame.f_code.co_filename.startswith("<frozen importlib")
        frame = frame.f_back
    if frame is None:       # the command has not begun, or has ended
        os._exit(STATUS)
    if importing:       # a KeyboardInterrupt now could be lost: libraries catch failed imports
        return _again(number)
    raise KeyboardInterrupt


def _again(number: int) -> None:
    """Send this process the signal again after RETRY seconds."""
    # Do not use threading.Thread: its lock may be held by the interrupted code.
    start_new_thread(_send, (number,))


def _send(number: int) -> None:
    time.sleep(RETRY)
    os.kill(os.getpid(), number)


def _not_raised(problem: sys.UnraisableHookArgs) -> None:
    """Send again a KeyboardInterrupt that Python could not raise, for example in ``__del__``.

    Print any other exception as usual.
    """
    if issubclass(problem.exc_type, KeyboardInterrupt):
        _again(signal.SIGINT)
    else:
        sys.__unraisablehook__(problem)


@contextlib.contextmanager
def deferred() -> Iterator[None]:
    """Return a context that postpones an interrupt to the end of the context.

    Use the context around native code that calls Python code and cannot handle an exception, such
    as moderngl's compiler, where an exception causes a segmentation fault.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield           # Python interrupts its main thread only
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            signal.raise_signal(signal.SIGINT)


@contextlib.contextmanager
def left_to_this_process() -> Iterator[None]:
    """Return a context in which processes that this thread starts do not receive Ctrl-C.

    The context also applies to threads that this thread starts, and to their processes. Other
    threads of this process still receive the signal.
    """
    from multiprocessing import resource_tracker
    resource_tracker.ensure_running()       # a later start of the tracker would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
