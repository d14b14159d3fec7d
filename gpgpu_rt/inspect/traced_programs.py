"""Traced programs: lists the programs that a trace compiles, with their names and texts."""
from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import OptionError, nearest_names
from ..gl.context import open_gpu
from ..gl.shader import ROOT, Compilation, compilations
from ..methods import find_method
from ..scene.scene import Scene
from ..tracer import Tracer
from .program_text import files_of, heading, program_text, titled

SCENE = "cornell"       # default scene; programs depend on the scene's tree and tables
SIDE = 8                # side of the picture in pixels; no effect on programs
_TRIANGLE_TEST = "glsl/core/triangle.glsl"
_INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)
_KERNEL = re.compile(r"F\(\d+, (\w+)\)")      # an entry of the define EACH_KERNEL


@dataclass(frozen=True)
class TracedProgram:
    """A program that a trace compiles.

    Attributes
    ----------
    name : the kernel of a program with a single kernel, else the name of the file; a number
        distinguishes equal names
    file : the program's entry file, as ``glsl/...`` or absolute
    text : GLSL that compiles by itself, see `program_text`
    traverses : whether the program runs traversal steps; False for auxiliary programs
    """

    name: str
    file: str
    text: str
    traverses: bool

    @property
    def files(self) -> list[str]:
        """The files that the text comes from."""
        return files_of(self.text)

    def to_dict(self) -> dict[str, Any]:
        """Return the program as plain data."""
        return {"name": self.name, "file": self.file, "lines": len(self.text.splitlines()),
                "traverses": self.traverses, "files": self.files, "text": self.text}


def traced_programs(method: str, options: Mapping[str, Any] | None = None,
                    scene: Scene | str = SCENE) -> list[TracedProgram]:
    """Return the programs that a method compiles to trace eye rays.

    Programs that traverse come first, vertex programs last.

    Parameters
    ----------
    method : a name of the method table
    options : the options of the tracer and of the method, as for `Tracer`
    scene : the scene; its accelerator determines sizes, such as the size of a stack

    Raises
    ------
    Error
        see `Tracer` and `Tracer.trace`
    """
    options = dict(options or {})
    gpu = open_gpu(options.get("context"))
    with gpu, compilations(gpu) as found, Tracer(scene, method, **options) as tracer:
        tracer.trace(*tracer.scene.camera.rays((SIDE, SIDE)))
        schedule, glsl = tracer.options["schedule"], str(tracer.method.glsl)
        extensions = gpu.context.extensions
    unique = list({one.fragment.text: one for one in found}.values())
    begun = {one.fragment_file for one in unique if not _only_starts(one)}
    texts = [program_text(one.fragment, extensions) for one in unique]
    own = {heading(glsl), _TRIANGLE_TEST}
    if not any(heading(glsl) in files_of(text) for text in texts):
        # The method's file only includes other files, which contain the traversal.
        own |= {heading(file) for file in _INCLUDE.findall((ROOT / glsl).read_text())}
    rows = []
    for one, text in zip(unique, texts):
        starts = _only_starts(one) and one.fragment_file in begun
        rows.append((one, text, bool(own & set(files_of(text))) and not starts))
    rows.sort(key=lambda row: (not row[2], row[0].defines.get("ONLY_KERNEL")
                               or row[0].defines.get("KERNEL_PHASE") or 0))
    vertex = {one.vertex_file: program_text(one.vertex, extensions) for one in unique}
    whose = f"{method} under {schedule}"
    fragments = [
        TracedProgram(name, heading(one.fragment_file), titled(
            text, f"{whose}: {name}", f"Switches: {_switches(one)}"), traverses)
        for name, (one, text, traverses) in zip(_distinct(_name(row[0]) for row in rows), rows)]
    return fragments + [
        TracedProgram(Path(file).name, heading(file), titled(
            text, f"{whose}: {Path(file).name}"), False) for file, text in vertex.items()]


def method_files(method: str) -> dict[str, tuple[str, ...]]:
    """Return the GLSL files of a method's programs: file -> schedules whose programs use the file.

    Raises
    ------
    Error
        see `traced_programs`
    """
    found: dict[str, tuple[str, ...]] = {}
    for schedule in find_method(method).schedules:
        programs = traced_programs(method, {"schedule": schedule})
        for file in dict.fromkeys(file for one in programs for file in one.files):
            found[file] = (*found.get(file, ()), schedule)
    return found


def find_program(programs: Collection[TracedProgram], name: str) -> TracedProgram:
    """Return the program with this name, or raise OptionError with the nearest names."""
    for one in programs:
        if one.name == name:
            return one
    raise OptionError(f"no program {name!r}" + nearest_names(name, [one.name for one in programs]))


def _switches(one: Compilation) -> str:
    found = sorted(name for name, value in one.defines.items() if value is True)
    return ", ".join(found) or "none"


def _only_starts(one: Compilation) -> bool:
    """Return whether a program only sets up rays, and leaves the traversal to another program."""
    return bool(one.defines.get("START")) and not one.defines.get("MANY_STEPS")


def _name(one: Compilation) -> str:
    if era_kernel := one.defines.get("KERNEL"):
        return str(era_kernel)
    kernel = one.defines.get("ONLY_KERNEL")
    if kernel:
        return _KERNEL.findall(str(one.defines["EACH_KERNEL(F)"]))[int(str(kernel)) - 1]
    return Path(one.fragment_file).stem + ("-start" if _only_starts(one) else "")


def _distinct(names: Iterable[str]) -> Iterator[str]:
    """Yield the names. A repeated name gets a number."""
    times: dict[str, int] = {}
    for name in names:
        times[name] = times.get(name, 0) + 1
        yield name if times[name] == 1 else f"{name}-{times[name]}"
