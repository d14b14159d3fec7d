"""The one place that compiles: resolves includes and defines, and words compile errors.

A program is an entry file in ``glsl/passes/`` that begins with ``#version`` and includes what it
needs: ``#include "common/hit.glsl"`` names a file under ``glsl/``, ``#include <records>`` a text
that Python generated (the accessors of the records in use). Each file is included once.

Lines are traced back to their files by a table of ours and not by ``#line``: Mesa reports an
undeclared name in file 0 whatever ``#line`` said.
"""
from __future__ import annotations

import importlib.resources
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import moderngl

from .errors import ShaderError
from .gpu import Gpu

ROOT = Path(str(importlib.resources.files("gpgpu_rt.glsl")))

_INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"(?P<file>[^"]+)"|<(?P<virtual>\w+)>)\s*$')
_VERSION = re.compile(r"^\s*#\s*version\b")
# "0:12(5): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:" (others)
_LOCATION = re.compile(r"(?P<a>\d+):(?P<b>\d+)(?:\(\d+\))?:|(?P<c>\d+)\((?P<d>\d+)\)\s*:")

# Contraction to FMA breaks the watertight test; `precise` forbids it where a driver offers it.
_PREAMBLE = """#extension GL_ARB_gpu_shader5 : enable
#ifdef GL_ARB_gpu_shader5
#define PRECISE precise
#else
#define PRECISE
#endif"""


@dataclass
class Source:
    """A resolved program text, and for each of its lines the file and line it came from."""

    text: str
    origins: list[tuple[str, int]] = field(default_factory=list)


def resolve(entry: str, defines: Mapping[str, object] | None = None,
            virtual: Mapping[str, str] | None = None) -> Source:
    """The text of ``entry`` with every include in place.

    Parameters
    ----------
    entry : path of the entry file, relative to ``glsl/`` or absolute
    defines : name -> value; True defines without a value, None and False leave out
    virtual : name -> generated text for ``#include <name>``; a value that begins with
        ``file:`` stands for that file, relative to ``glsl/`` or absolute

    Raises
    ------
    ShaderError
        for a file that is missing, an unknown virtual include or a cycle.
    """
    virtual = virtual or {}
    source = Source("")
    lines: list[str] = []
    done: set[str] = set()

    def add(name: str, text: str, chain: tuple[str, ...]) -> None:
        for at, line in enumerate(text.splitlines(), 1):
            include = _INCLUDE.match(line)
            if include:
                include_one(include, name, at, (*chain, name))
                continue
            added = [line]
            if _VERSION.match(line) and not chain:
                added += [*_PREAMBLE.splitlines(), *_define_lines(defines or {})]
            lines.extend(added)
            source.origins.extend([(name, at)] * len(added))

    def include_one(include: re.Match[str], by: str, at: int, chain: tuple[str, ...]) -> None:
        name = include["file"] or f"<{include['virtual']}>"
        text = None
        if include["virtual"]:
            if include["virtual"] not in virtual:
                raise ShaderError(f"{by}:{at}: nothing was generated for {name}")
            text = virtual[include["virtual"]]
            if text.startswith("file:"):
                name, text = text.removeprefix("file:"), None
        if name in chain:
            raise ShaderError(f"{by}:{at}: include cycle {' -> '.join((*chain, name))}")
        if name not in done:
            done.add(name)
            add(name, _read(name, f"{by}:{at}: ") if text is None else text, chain)

    add(entry, _read(entry, ""), ())
    source.text = "\n".join(lines) + "\n"
    return source


def _read(name: str, where: str) -> str:
    try:
        return (ROOT / name).read_text()   # an absolute name replaces ROOT
    except OSError as failure:
        raise ShaderError(f"{where}cannot read {name} ({failure.strerror})") from failure


def _define_lines(defines: Mapping[str, object]) -> list[str]:
    return [f"#define {name}" + ("" if value is True else f" {value}")
            for name, value in sorted(defines.items()) if value is not None and value is not False]


def compile_program(gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                    virtual: Mapping[str, str] | None = None,
                    vertex: str = "passes/full_screen.vert") -> moderngl.Program:
    """A linked program, the same object again for the same text.

    Raises
    ------
    ShaderError
        that names file, line and the defines in force.
    """
    vertex_source = resolve(vertex, {}, virtual)
    source = resolve(fragment, defines, virtual)
    key = (vertex_source.text, source.text)
    if key not in gpu.programs:
        try:
            gpu.programs[key] = gpu.context.program(vertex_shader=vertex_source.text,
                                                    fragment_shader=source.text)
        except moderngl.Error as failure:
            raise ShaderError(_word_log(str(failure), source, defines or {})) from failure
    return gpu.programs[key]


def _word_log(log: str, source: Source, defines: Mapping[str, object]) -> str:
    def name_file(match: re.Match[str]) -> str:
        line = int(match["b"] or match["d"])
        if not 0 < line <= len(source.origins):
            return match[0]
        return "{}:{}:".format(*source.origins[line - 1])

    first = next((line for line in log.splitlines() if "error" in line.lower()
                  and _LOCATION.search(line)), None)
    message = _LOCATION.sub(name_file, first or " ".join(log.split())[:300], count=1)
    in_force = " ".join(line.removeprefix("#define ") for line in _define_lines(defines))
    return f"{message.strip()} [defines: {in_force or 'none'}]"
