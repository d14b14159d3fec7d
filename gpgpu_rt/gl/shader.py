"""Compilation of programs: resolves includes and defines, and formats compile errors.

A program has two entry files, a ``.vert`` and a ``.frag``, which begin with ``#version``.
``#include "core/hit.glsl"`` names a file under ``glsl/``. ``#include <records>`` names a text that
Python generated, such as the accessors of records. Each file is included once.

`Source` maps lines to their files, because Mesa reports some errors in file 0 despite ``#line``.
"""
from __future__ import annotations

import functools
import importlib.resources
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import moderngl

from .. import interrupts
from ..errors import ShaderError
from .angle_text import angle_texts
from .context import Gpu

ROOT = Path(str(importlib.resources.files("gpgpu_rt.glsl")))

DEFINES = "<defines>"    # file name of the lines below ``#version``
MOST_PROGRAMS = 512      # programs to keep; a software renderer needs 1 MiB for each

_INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"(?P<file>[^"]+)"|<(?P<virtual>\w+)>)\s*$')
_VERSION = re.compile(r"^\s*#\s*version\b")
# "0:12(5): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:" (others)
_LOCATION = re.compile(r"(?P<a>\d+):(?P<b>\d+)(?:\(\d+\))?:|(?P<c>\d+)\((?P<d>\d+)\)\s*:")

# Contraction to FMA breaks the watertight test. `precise` forbids contraction; drivers without
# `precise` may contract.
_PREAMBLE = """#extension GL_ARB_gpu_shader5 : enable
#ifdef GL_ARB_gpu_shader5
#define PRECISE precise
#else
#define PRECISE
#endif"""
_OLD_PREAMBLE = "#define PRECISE"       # GLSL 1.20 lacks the extension


@dataclass
class Source:
    """A resolved program text with the origin of its lines.

    Attributes
    ----------
    runs : runs of consecutive lines of a file. A run is (number of lines of the text before the
        run, file, first line in the file, number of lines)
    """

    text: str
    runs: list[tuple[int, str, int, int]] = field(default_factory=list)

    def files(self) -> list[str]:
        """Return the file of each line; ``<name>`` for a generated text."""
        return [name for _, name, _, count in self.runs for _ in range(count)]

    def origin(self, line: int) -> tuple[str, int] | None:
        """Return the (file, line in the file) of a line of the text; lines count from 1."""
        for before, name, first, count in self.runs:
            if before < line <= before + count:
                return name, first + line - before - 1
        return None


@dataclass(frozen=True)
class Compilation:
    """A call of ``compile_program``: entry files, their resolved texts, and the fragment program's
    defines."""

    fragment_file: str
    vertex_file: str
    fragment: Source
    vertex: Source
    defines: Mapping[str, object]


class _LineBlock(NamedTuple):
    """Lines of a file before an ``#include``, or up to ``#version``."""

    first: int
    lines: tuple[str, ...]
    include: re.Match[str] | None
    version: bool


@functools.lru_cache(maxsize=1024)     # hundreds of programs share texts
def _line_blocks(text: str) -> tuple[_LineBlock, ...]:
    found, first = [], 1
    lines = text.splitlines()
    for at, line in enumerate(lines, 1):
        if "#" not in line:
            continue
        include, version = _INCLUDE.match(line), bool(_VERSION.match(line))
        if include or version:
            found.append(_LineBlock(first, tuple(
                lines[first - 1:at - bool(include)]), include, version))
            first = at + 1
    return (*found, _LineBlock(first, tuple(lines[first - 1:]), None, False))


def resolve(entry: str, defines: Mapping[str, object] | None = None,
            virtual: Mapping[str, str] | None = None) -> Source:
    """Return the text of ``entry`` with every ``#include`` replaced by the included text.

    Parameters
    ----------
    entry : path of the entry file, relative to ``glsl/`` or absolute
    defines : name -> value. True defines a name without a value; None and False define nothing
    virtual : name -> generated text for ``#include <name>``, or ``file:`` and a file's name,
        relative to ``glsl/`` or absolute

    Raises
    ------
    ShaderError
        for a missing file, an unknown virtual include or a cycle
    """
    virtual = virtual or {}
    source = Source("")
    lines: list[str] = []
    done: set[str] = set()

    def put(name: str, first: int, added: Sequence[str]) -> None:
        source.runs.append((len(lines), name, first, len(added)))
        lines.extend(added)

    def add(name: str, text: str, chain: tuple[str, ...]) -> None:
        for run in _line_blocks(text):
            put(name, run.first, run.lines)
            at = run.first + len(run.lines)
            if run.include:
                include_one(run.include, name, at, (*chain, name))
            if run.version and not chain:
                old = run.lines[-1].split()[1] < "330"
                put(DEFINES, 1, (*(_OLD_PREAMBLE if old else _PREAMBLE).splitlines(),
                                 *_define_lines(defines or {})))

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
                    vertex: str = "drivers/full_screen.vert") -> moderngl.Program:
    """Return a linked program. Calls with the same texts return the same object.

    Raises
    ------
    ShaderError
        for a compile error; the message names the file, the line and the defines
    """
    vertex_source = resolve(vertex, {}, virtual)
    source = resolve(fragment, defines, virtual)
    if gpu.compilations is not None:
        gpu.compilations.append(Compilation(fragment, vertex, source, vertex_source,
                                            dict(defines or {})))
    key = (vertex_source.text, source.text)
    program = gpu.programs.pop(key, None)
    if program is None:
        _let_go(gpu)
        texts = angle_texts(*key) if gpu.is_es else key
        try:
            with interrupts.deferred():
                program = gpu.context.program(vertex_shader=texts[0], fragment_shader=texts[1])
        except moderngl.Error as failure:
            # A heading above the log says which program is wrong.
            wrong = vertex_source if "\nvertex_shader\n=" in str(failure) else source
            raise ShaderError(_word_log(str(failure), wrong, defines or {})) from failure
    gpu.programs[key] = program    # now the most recently used
    return program


@contextmanager
def compilations(gpu: Gpu) -> Iterator[list[Compilation]]:
    """List every call of ``compile_program`` in the block, even calls that reuse a program."""
    before, gpu.compilations = gpu.compilations, []
    try:
        yield gpu.compilations
    finally:
        gpu.compilations = before


def _let_go(gpu: Gpu) -> None:
    """Release unused programs, the least recently requested first, to add another program."""
    for key in list(gpu.programs):
        if len(gpu.programs) < MOST_PROGRAMS:
            return
        if sys.getrefcount(gpu.programs[key]) == 2:    # only the table and this call refer to it
            gpu.programs.pop(key).release()


def _word_log(log: str, source: Source, defines: Mapping[str, object]) -> str:
    def name_file(match: re.Match[str]) -> str:
        origin = source.origin(int(match["b"] or match["d"]))
        return match[0] if origin is None else "{}:{}:".format(*origin)

    first = next((line for line in log.splitlines() if "error" in line.lower()
                  and _LOCATION.search(line)), None)
    message = _LOCATION.sub(name_file, first or " ".join(log.split())[:300], count=1)
    in_force = " ".join(line.removeprefix("#define ") for line in _define_lines(defines))
    return f"{message.strip()} [defines: {in_force or 'none'}]"
