"""Static costs: the instructions that Mesa's compilers for old cards generate from kernels.

Mesa's drivers for cards of 2002-2006 compile the era form of kernels (traversal/era.py, dialect
``card``), even without such a card. ``tools/static_costs.py`` writes the results into
``static_costs/CARD.json``, keyed by the program's digest. All other code reads these files.
"""
from __future__ import annotations

import functools
import hashlib
import importlib.resources
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import OptionError, nearest_names
from ..inspect.program_text import program_text
from ..methods import built_in_methods, find_method
from ..options import TEXEL_POINTERS
from ..traversal.era import EraKernel, era_kernels
from ..traversal.era_packets import packet_kernels, packet_loop

COMPILERS = ("r300", "r420", "r580", "nv40", "g80")
# Chips that select a program's form. Pointers are indices on INDEX_CHIP, and columns and rows on
# TEXEL_CHIP.
INDEX_CHIP, TEXEL_CHIP = "nv40", "r420"
# The depth of a stack that never drops entries is a constant of the program. The constant changes
# no instruction, so any depth serves here. The depth of a short stack is an option of the method.
DEFINES: Mapping[str, object] = {"STACK_SIZE": 32}
# Settings to compile in addition to the defaults: (method, options).
SETTINGS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("bvh-threaded", {"octants": True}), ("tree-unit", {"criterion": "box"}))
# Packet methods to compile, as kernels in a loop: (method, options). Each entry adds an
# improvement of Horn et al.
PACKETS: tuple[tuple[str, Mapping[str, Any]], ...] = tuple(
    ("kd-packet", {"push_down": down, "stack_size": size, "skip_empty_leaves": False})
    for down, size in ((False, 0), (True, 0), (True, 3)))


@dataclass(frozen=True)
class EraProgram:
    """A kernel's text in the dialect of the cards, and the digest of its code.

    Attributes
    ----------
    method, kernel : names
    text : GLSL 1.20
    digest : SHA-256 of the text without comments and empty lines, in hexadecimal
    """

    method: str
    kernel: str
    text: str
    digest: str


@dataclass(frozen=True)
class StaticCost:
    """The cost of a kernel, as a card's compiler reports it.

    Attributes
    ----------
    card, method, kernel : Names.
    arithmetic : Arithmetic instructions as the card issues them. R300 to R580 issue a vector and a
        scalar operation as one instruction. NV40's driver pairs no operations, so each operation
        is an instruction.
    vector, scalar : Numbers of vector and of scalar operations, or 0 if the driver does not
        distinguish them.
    fetches : Texture fetches.
    levels : Levels of texture indirection. A fetch is one level above the fetches on which its
        coordinates depend.
    registers : Temporary registers of a fragment.
    targets : Render targets written.
    cycles : The driver's own estimate of clocks, or None.
    listing : The compiled program as the driver prints it. Empty for G80, whose driver prints only
        counts.
    digest : Digest of the program.
    refused : The compiler's message if it refused the program, else empty.
    """

    card: str
    method: str
    kernel: str
    arithmetic: int = 0
    vector: int = 0
    scalar: int = 0
    fetches: int = 0
    levels: int = 0
    registers: int = 0
    targets: int = 0
    cycles: int | None = None
    listing: str = ""
    digest: str = ""
    refused: str = ""

    @property
    def slots(self) -> int:
        """Instruction slots. On R300 to R580, an instruction has a slot for its vector operation
        and a slot for its scalar operation."""
        return 2 * self.arithmetic if self.vector else self.arithmetic

    def to_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


@dataclass(frozen=True)
class CompiledCosts:
    """The results of a card's compiler.

    Attributes
    ----------
    driver : name and version of the driver
    date : the day of the compilation, ISO 8601
    programs : digest -> cost
    """

    driver: str = ""
    date: str = ""
    programs: Mapping[str, StaticCost] = field(default_factory=dict)


def era_methods(era: str | bool = True) -> list[str]:
    """Return the built-in methods whose era form runs one kernel per pass. ``era`` is a chip, or
    True for any chip."""
    return [row.name for row in built_in_methods()
            if not row.why_no_era_form(era) and row.era_packets is None]


def packet_methods() -> list[str]:
    """Return the built-in methods whose era form runs packets, always in a loop."""
    return [row.name for row in built_in_methods() if row.era_packets is not None]


def era_programs(method: str, any_hit: bool = False, in_loop: bool = False,
                 card: str = INDEX_CHIP, **options: Any) -> tuple[EraProgram, ...]:
    """Return the kernels of a method in the era form, in the dialect of the cards. For packets,
    the last program is the whole loop.

    Parameters
    ----------
    method : a name of the method table
    any_hit : whether rays stop at their first hit
    in_loop : whether the kernels are branches in a loop, not passes; must be true for packets
    card : the chip. Only the kernels of passes depend on it, because chips with fp24 have no loops
    options : the method's options

    Raises
    ------
    OptionError
        for a method without an era form
    """
    chip = TEXEL_CHIP if card in TEXEL_POINTERS and not in_loop else INDEX_CHIP
    return _programs(method, any_hit, in_loop, chip, tuple(sorted(options.items())))


@functools.cache    # making a text is slow
def _programs(method: str, any_hit: bool, in_loop: bool, chip: str,
              options: tuple[tuple[str, Any], ...]) -> tuple[EraProgram, ...]:
    row = find_method(method)
    if in_loop and row.era_packets is not None:
        resolved = row.resolved(dict(options))
        return tuple(_program(method, kernel) for kernel in (
            *packet_kernels(row, resolved, any_hit), packet_loop(row, resolved, any_hit)))
    resolved = row.resolved({**dict(options), "era": chip})
    defines = {name: value for name, value in DEFINES.items() if name not in row.defines(resolved)}
    kernels = era_kernels(row.formed(resolved), resolved, any_hit, defines, in_loop)
    return tuple(_program(method, kernel) for kernel in kernels)


def _program(method: str, kernel: EraKernel) -> EraProgram:
    text = program_text(kernel.source("card"))
    return EraProgram(method, kernel.name, text, digest_of(text))


def all_era_programs() -> list[EraProgram]:
    """Return the programs of every method with an era form, for nearest hits and for any hits.

    For default options and SETTINGS, the order is: passes with indices as pointers, loops with
    indices, passes with columns and rows. The loops of PACKETS follow. Each compiler reads all
    programs, because `machine_model.stream_fetches` needs NV40's listings.
    """
    chosen = [(era, in_loop, [*((name, {}) for name in era_methods(era)), *SETTINGS])
              for era, in_loop in ((INDEX_CHIP, False), (INDEX_CHIP, True), (TEXEL_CHIP, False))]
    return [program for era, in_loop, some in (*chosen, (INDEX_CHIP, True, PACKETS))
            for name, options in some for any_hit in (False, True)
            for program in era_programs(name, any_hit, in_loop, era, **options)]


def digest_of(text: str) -> str:
    """Return the digest of a program's code, without comments and empty lines."""
    lines = (" ".join(line.partition("//")[0].split()) for line in text.splitlines())
    return hashlib.sha256("\n".join(line for line in lines if line).encode()).hexdigest()


@functools.cache
def compiled_costs(card: str) -> CompiledCosts:
    """Return the results of a card's compiler; empty if the compiler never ran.

    Raises
    ------
    OptionError
        for a chip without a compiler
    """
    if card not in COMPILERS:
        raise OptionError(f"there is no compiler for the card {card!r}"
                          + nearest_names(card, COMPILERS))
    file = importlib.resources.files("gpgpu_rt.hardware") / "static_costs" / f"{card}.json"
    if not file.is_file():
        return CompiledCosts()
    data = json.loads(file.read_text())
    return CompiledCosts(data["driver"], data["date"], {
        digest: StaticCost(card=card, digest=digest, **entry)
        for digest, entry in data["programs"].items()})


def static_cost(card: str, method: str, kernel: str, any_hit: bool = False,
                in_loop: bool = False, as_on: str = "", **options: Any) -> StaticCost:
    """Return the cost of a method's kernel on a card, or on this card in the form for the chip
    ``as_on`` (`era_programs`).

    Raises
    ------
    OptionError
        for an unknown card or kernel, a method without an era form, or a kernel that was not
        compiled for this card
    """
    programs = {one.kernel: one
                for one in era_programs(method, any_hit, in_loop, as_on or card, **options)}
    if kernel not in programs:
        raise OptionError(f"method {method} has no kernel {kernel!r}"
                          + nearest_names(kernel, programs))
    cost = compiled_costs(card).programs.get(programs[kernel].digest)
    if cost is None:
        raise OptionError(f"kernel {kernel} of {method} was not compiled for {card} with these "
                          "options; leave the method's options at their defaults")
    return replace(cost, method=method, kernel=kernel)    # methods may share a kernel
