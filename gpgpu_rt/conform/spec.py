"""Spec: names an engine, a method of this project, a user's function or a user's program.

A spec can be sent to another process and loaded there.
"""
from __future__ import annotations

import importlib
import importlib.util
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __name__ as PROJECT
from ..errors import OptionError, nearest_names
from ..methods import find_method
from ..tracer import Tracer
from .answers import EngineAnswers, Trace, of_distances
from .case import Case
from .engines import ALL_T, ENGINES, Adapter
from .export import case_to_dict

ENGINE, METHOD, FUNCTION, COMMAND = "engine", "method", "function", "command"
PLACES = ("{cases}", "{answers}")
# Time limit in seconds for a call of a program. For the first case, `Runner` calls a program
# twice, and both calls must fit into `runner.SECONDS`.
COMMAND_SECONDS = 120


@dataclass(frozen=True)
class Spec:
    """An engine, a method with a schedule, a function or a program.

    Attributes
    ----------
    kind : ENGINE, METHOD, FUNCTION or COMMAND
    name : the engine, the method, "module:function", or the command line
    schedule : the schedule of a method; "" for the method's default
    """

    kind: str
    name: str
    schedule: str = ""

    def __post_init__(self) -> None:
        if self.kind == ENGINE and self.name not in ENGINES:
            raise OptionError(f"no engine {self.name!r}{nearest_names(self.name, ENGINES)}; for "
                              "your own function give MODULE:FUNCTION")
        if self.kind == METHOD:
            find_method(self.name).resolved({"schedule": self.schedule} if self.schedule else {})
        if self.kind == FUNCTION and not all(self.name.partition(":")):
            raise OptionError(f"--engine {self.name!r}: give a name that --list prints, or "
                              "MODULE:FUNCTION")
        module = self.name.partition(":")[0]
        if self.kind == FUNCTION and not _found(module):
            hint = "; give the name without .py" if module.endswith(".py") else ""
            raise OptionError(f"--engine {self.name!r}: no module {module!r} in Python's path or "
                              f"in this folder{hint}")
        if self.kind == COMMAND:
            for place in PLACES:
                if place not in self.name:
                    raise OptionError(f"--command {self.name!r} lacks {place}; give for example "
                                      "'./mytracer {cases} {answers}'")
            try:
                words = shlex.split(self.name)
            except ValueError as failure:
                raise OptionError(f"--command {self.name!r}: {failure}") from failure
            if shutil.which(words[0]) is None:
                raise OptionError(f"--command {self.name!r}: no program {words[0]}")

    @classmethod
    def of(cls, word: str) -> Spec:
        return cls(FUNCTION if ":" in word else ENGINE, word)

    @property
    def title(self) -> str:
        """The name in tables."""
        return f"{self.name} {self.schedule}".strip()

    @property
    def engine(self) -> Adapter:
        """The engine's row of ENGINES, or a new row for a method, function or program."""
        if self.kind == ENGINE:
            return ENGINES[self.name]
        return Adapter(self.title, PROJECT if self.kind == METHOD else "", (), self.load,
                       ends=() if self.kind == FUNCTION else ALL_T)

    def load(self) -> Trace:
        """Import the engine, method or function; return a function from a case to its answers."""
        if self.kind == ENGINE:
            return ENGINES[self.name].prepare()
        if self.kind == METHOD:
            return self._method()
        return self._function() if self.kind == FUNCTION else self._command()

    def _method(self) -> Trace:
        chosen = {"schedule": self.schedule} if self.schedule else {}

        def trace(case: Case) -> EngineAnswers:
            options = {**case.options.get(self.name, {}), **chosen}
            with Tracer(case.scene, self.name, **options) as tracer:
                hits = tracer.trace(*case.rays)
                any_hit = tracer.occluded(case.origins, case.directions, t_min=case.t_min,
                                          t_max=case.t_max)
                return EngineAnswers(hits.triangle, hits.t, any_hit)
        return trace

    def _function(self) -> Trace:
        module, _, name = self.name.partition(":")
        sys.path.insert(0, os.getcwd())
        function = importlib.import_module(module)
        for part in name.split("."):
            function = getattr(function, part)
        if not callable(function):
            raise TypeError(f"{name} has the type {type(function).__name__} and is no function")

        def trace(case: Case) -> EngineAnswers:
            found = function(case.triangles, case.origins, case.directions)
            if not isinstance(found, tuple) or len(found) != 2:
                raise ValueError(f"{self.name} must return (t, triangle), two arrays with an "
                                 f"entry for each ray; it returned {_described(found)}")
            return of_distances(case, *found)
        return trace

    def _command(self) -> Trace:
        def trace(case: Case) -> EngineAnswers:
            with tempfile.TemporaryDirectory(prefix="conform") as folder:
                places = [Path(folder) / name for name in ("cases.json", "answers.json")]
                places[0].write_text(json.dumps(case_to_dict(case)))
                words = [word.replace(PLACES[0], str(places[0])).replace(PLACES[1], str(places[1]))
                         for word in shlex.split(self.name)]
                _call(words)
                try:
                    found = json.loads(places[1].read_text())
                except (OSError, ValueError) as failure:
                    raise ValueError(f"no JSON in {PLACES[1]}: {failure}") from failure
                return answers_from_dict(found, len(case.origins))
        return trace


def _described(found: Any) -> str:
    size = f" of shape {found.shape}" if isinstance(found, np.ndarray) else (
        f" of {len(found)}" if isinstance(found, (tuple, list)) else "")
    return f"{type(found).__name__}{size}"


def _found(module: str) -> bool:
    sys.path.insert(0, os.getcwd())
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False
    finally:
        sys.path.remove(os.getcwd())


def _call(words: list[str]) -> None:
    """Run a program. After COMMAND_SECONDS or an interrupt, kill the program and its children."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                          start_new_session=True) as program:
        try:
            _, errors = program.communicate(timeout=COMMAND_SECONDS)
        except BaseException:
            os.killpg(program.pid, signal.SIGKILL)
            raise
    if program.returncode:
        last = (errors.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"exit status {program.returncode}: {last[:200]}")


def answers_from_dict(found: Any, rays: int) -> EngineAnswers:
    """Return the answers of a file that a program wrote.

    Parameters
    ----------
    found : lists with an entry per ray: ``triangle`` (negative or null for a miss), and optionally
        ``t`` and ``any_hit``

    Raises
    ------
    ValueError
        the list ``triangle`` is missing, or a list has another length
    """
    if not isinstance(found, dict) or "triangle" not in found:
        raise ValueError("the answers must be an object with the list \"triangle\"")
    arrays = {name: np.array([np.nan if one is None else one for one in found[name]], np.float64)
              for name in ("triangle", "t", "any_hit") if found.get(name) is not None}
    for name, array in arrays.items():
        if array.shape != (rays,):
            raise ValueError(f"{name} has shape {array.shape}; expected ({rays},)")
    triangle = np.where(np.isnan(arrays["triangle"]), -1, arrays["triangle"])
    any_hit = arrays.get("any_hit")
    return EngineAnswers(triangle, arrays.get("t"), None if any_hit is None else any_hit != 0)
