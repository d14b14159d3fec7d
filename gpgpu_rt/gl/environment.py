"""Environment: records the program, libraries, renderer and processor of a measurement."""
from __future__ import annotations

import datetime
import functools
import importlib.metadata
import platform
import subprocess
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .. import __version__
from .context import Gpu, open_gpu

LIBRARIES = ("moderngl", "numpy", "trimesh", "Pillow", "matplotlib", "distributed", "embreex")
_ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class RunEnvironment:
    """The software and the hardware of a measurement.

    Parameters
    ----------
    version, commit : the version of gpgpu_rt, and the commit of its checkout, or None
    python : the version of Python, such as "3.11.2"
    libraries : name -> version of each installed library of `LIBRARIES`
    renderer : OpenGL's name of the renderer; for llvmpipe with the width of its vectors
    opengl : OpenGL's version, with the version of Mesa if Mesa is the driver
    processor : the model of the processor, or its architecture if the model is unknown
    system : the operating system, such as "Debian GNU/Linux 12 (bookworm)"
    """

    version: str
    commit: str | None
    python: str
    libraries: dict[str, str]
    renderer: str
    opengl: str
    processor: str
    system: str


def environment(gpu: Gpu | None = None) -> RunEnvironment:
    """Return the environment of this process and of ``gpu``, by default ``open_gpu()``."""
    gpu, facts = gpu or open_gpu(), processors()
    return RunEnvironment(
        __version__, commit(), platform.python_version(),
        {name: found for name in LIBRARIES if (found := _installed(name))}, gpu.renderer,
        gpu.version, (facts[0].get("model name") if facts else None) or platform.machine(),
        _system())


def run_facts(gpu: Gpu, command: str) -> dict[str, Any]:
    """Return the entries of a measurement's JSON that describe its run.

    Parameters
    ----------
    gpu : the context of the measurement
    command : the command line

    Returns
    -------
    dict
        ``gpu``, ``environment``, ``date`` (date and time of now, UTC) and ``command``
    """
    now = datetime.datetime.now(datetime.timezone.utc)
    return {"gpu": gpu.info(), "environment": asdict(environment(gpu)),
            "date": now.isoformat(timespec="seconds"), "command": command}


@functools.cache
def commit() -> str | None:
    """Return the commit of gpgpu_rt's checkout, or None without a checkout. A repository around an
    installed gpgpu_rt does not count."""
    if not (_ROOT / ".git").exists():
        return None
    try:
        return subprocess.run(["git", "describe", "--always", "--dirty"], text=True, check=True,
                              capture_output=True, cwd=_ROOT).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def processors() -> list[dict[str, str]]:
    """Return /proc/cpuinfo as a dict per logical processor; [] if the file does not exist."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return []
    pairs = ([line.split(":", 1) for line in part.splitlines() if ":" in line]
             for part in text.strip().split("\n\n"))
    return [{key.strip(): value.strip() for key, value in part} for part in pairs]


def _installed(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _system() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        return f"{platform.system()} {platform.release()}"
