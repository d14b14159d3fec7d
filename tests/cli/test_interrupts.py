"""Ctrl-C in the first two seconds of a command ends the command silently, with status 130. There
are two exceptions: a command that has already ended, and Python while it starts or ends."""
from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

HANG = 60  # seconds after which an interrupted process counts as hung
STARTS = 2.0  # the interrupt comes within this many seconds after the start of a command

COMMANDS = {
    "render": "-m gpgpu_rt render bunny --size 256x256 -o {folder}/picture.png",
    "path": "-m gpgpu_rt render cornell --integrator path --samples 4096 -o {folder}/picture.png",
    "trace": "-m gpgpu_rt trace bunny {folder}/rays.npz -o {folder}/hits.npz",
    "tune": "-m gpgpu_rt tune cornell --max-wrong 1e-3 --max-t-error 1e-3",
    "bench": "-m gpgpu_rt bench cornell -m grid",
    "heat": "-m gpgpu_rt heat cornell -m grid,kd-restart -o {folder}/heat.png",
    "scenes": "-m gpgpu_rt scenes",
    "figures": "-m gpgpu_rt.figures --only fig12 --data {folder}/data --out {folder}/out",
    "shared": "-m gpgpu_rt render cornell --scheduler local -o {folder}/picture.png"}

# Text that Python prints with a traceback or with an ignored exception.
NOISE = ("Traceback", "Exception ignored", "KeyboardInterrupt", 'File "')
ROOT = Path(__file__).parents[2]
OURS = tuple(f'File "{ROOT / name}/' for name in ("gpgpu_rt", "figures"))


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Makes this process and its children react to Ctrl-C. Without this fixture, tests in a
    shell's background job would ignore Ctrl-C, and so would their children."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(words: list[str], after: float, folder: Path) -> tuple[int, str, str]:
    """Returns status, stdout and stderr of ``python WORDS``. After ``after`` seconds, the process
    and all its children receive SIGINT, as a terminal sends it on Ctrl-C."""
    process = subprocess.Popen([sys.executable, *words], cwd=folder, text=True,
                               start_new_session=True, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)
    try:
        time.sleep(after)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=HANG)
        return process.returncode, out, err
    finally:
        process.kill()
        process.wait()


def before_our_code(err: str) -> bool:
    """Returns whether the interrupt came while Python started, before any line of this package
    ran."""
    return "Traceback" in err and not any(place in err for place in OURS)


def check(command: str, after: float, folder: Path) -> None:
    rays = folder / "rays.npz"
    if command == "trace":
        np.savez(rays, origins=np.zeros((1 << 18, 3)), directions=np.ones((1 << 18, 3)))
    words = COMMANDS[command].format(folder=folder).split()
    status, out, err = interrupted(words, after, folder)
    if before_our_code(err):
        return
    said = f"{command}, interrupted after {after:.3f} s: status {status}\n{out}{err}"
    # The status is 0 if the command had already finished. The status is -SIGINT, which a shell
    # reports as 130, if Python did not handle signals yet, or no longer handled them.
    assert status in (0, 130, -signal.SIGINT), said
    assert not any(word in out + err for word in NOISE), said
    assert not [*folder.glob(".writing-*")], said


@pytest.mark.parametrize("command", ("render", "tune", "scenes", "figures"))
def test_an_early_interrupt_is_silent(command: str, tmp_path) -> None:
    check(command, random.Random(command).uniform(0.05, 1), tmp_path)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("command", COMMANDS)
def test_an_interrupt_is_silent_whenever_it_comes(command: str, seed: int, tmp_path) -> None:
    check(command, random.Random(f"{command} {seed}").uniform(0, STARTS), tmp_path)


# Where exceptions are lost ----------------------------------------------------------------------

# A module that raises an interrupt during its own import and swallows it.
SWALLOWING = """
try:
    import signal
    signal.raise_signal(signal.SIGINT)
except BaseException:
    pass
"""
# A program that interrupts itself. In most tests, the interrupt comes at a place where Python may
# lose an exception.
LOSING = """
import signal, sys, time
from gpgpu_rt.interrupts import run
class Lost:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
def command():
    {}
    time.sleep({})
    print("not interrupted")
    return 0
def load():
    {}
    return command
sys.exit(run(load))
"""


@pytest.mark.parametrize("within, sleep, loading", [
    ("import swallowing", HANG, ""), ("Lost()", HANG, ""),
    ("signal.raise_signal(signal.SIGINT)", HANG, ""),
    ("", HANG, "import swallowing"), ("", HANG, "Lost()")],
    ids=["import", "del", "plainly", "import while loading", "del while loading"])
def test_no_interrupt_is_lost(within: str, sleep: float, loading: str, tmp_path) -> None:
    (tmp_path / "swallowing.py").write_text(SWALLOWING)
    done = subprocess.run([sys.executable, "-c", LOSING.format(within, sleep, loading)],
                          cwd=tmp_path, capture_output=True, text=True, timeout=HANG)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_a_command_that_ignores_interrupts_goes_on(tmp_path) -> None:
    """If a parent process makes a command ignore SIGINT, as a shell script does with `&`, the
    command continues."""
    code = LOSING.format("signal.raise_signal(signal.SIGINT)", 0, "")
    done = subprocess.run([sys.executable, "-c", "import signal\n"
                           "signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + code],
                          cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "not interrupted\n")


def test_the_command_line_is_loaded_once_it_can_be_interrupted() -> None:
    """The entry modules import no slow module before the package can react to Ctrl-C."""
    code = ("import sys, gpgpu_rt.__main__, gpgpu_rt.figures.__main__\n"
            "print([name for name in sys.modules if name in ('numpy', 'typing', 'moderngl')])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "[]\n"
