"""Conformance runs: engines trace the families of extreme rays (conform/families.py)."""
from __future__ import annotations

import functools
import hashlib
import json
import subprocess
import sys
from typing import Any

from gpgpu_rt.conform.suite import installed
from gpgpu_rt.errors import Error

from . import extreme_runs

WORK = "conformance"


def measure(rays: int) -> dict[str, Any]:
    """Return the results of one method of this project and of all installed engines.

    The suite starts a process for each engine with multiprocessing, which Python forbids in a
    worker process. Therefore this function runs `gpgpu-rt conform` as a subprocess.
    """
    done = subprocess.run([sys.executable, "-m", "gpgpu_rt", "conform", "--json", "--rays",
                           str(rays)], capture_output=True, text=True)
    if done.returncode:
        raise Error(f"conform: {done.stderr.strip() or 'no message'}")
    return {"warm_ups": 0, "rows": json.loads(done.stdout)}


@functools.cache
def digest() -> str:
    """A digest of all cases and of the engines' versions."""
    versions = [(one.name, one.engine.version) for one in installed()[0]]
    return hashlib.sha256(f"{extreme_runs.digest()} {versions}".encode()).hexdigest()
