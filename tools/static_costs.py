"""Compile every era kernel for every card, and write gpgpu_rt/hardware/static_costs/CARD.json.

    python tools/static_costs.py --drivers FOLDER [--card CARD]...

An era kernel is a method's kernel as a card of 2002-2006 could run it (docs/era.md). FOLDER is the
result of tools/period_compilers.sh. Run this program after a change of a kernel's text: a test
names the kernels whose entries are out of date.
"""
from __future__ import annotations

import argparse
import datetime
import itertools
import json
import re
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from compile_for_card import run  # noqa: E402

from gpgpu_rt.hardware import static_costs  # noqa: E402

FOLDER = Path(static_costs.__file__).parent / "static_costs"
_RADEON = re.compile(r"says: FS shader: (?P<counts>.*)")
_COUNT = re.compile(r"(\d+) (\w+)")
_G80 = re.compile(r"says: type: 4, .*gpr: (?P<gpr>\d+), inst: (?P<inst>\d+)")
_LAST_STEP = "Fragment Program: after 'register allocation'\n"
_TGSI = re.compile(r"^ *\d+: +(?P<op>\w+) ?(?P<rest>.*)$", re.M)
_TEMP = re.compile(r"TEMP\[(\d+)\]")
_INPUT = re.compile(r"\bIN\[\d+\]")
_CONSTANT = re.compile(r"(?:CONST\[0\]|IMM)\[\d+\]")
# Operation of TGSI (Mesa's shader assembly) -> number of instructions that NV40's driver emits
# (nvfx_fragprog.c), if not 1. CMP sets the condition codes, and then moves each of its two values.
_INSTRUCTIONS = {"CMP": 3, "SSG": 3, "POW": 3, "TRUNC": 4, "CEIL": 2, "DP2": 2, "IF": 2,
                 "KILL_IF": 2, "LRP": 2, "RSQ": 2, "ELSE": 0, "ENDIF": 0, "ENDLOOP": 0}


def cost_of(card: str, said: str, text: str) -> dict[str, Any]:
    """Return a StaticCost's fields from the driver's output."""
    found: dict[str, Any] = {"targets": len(set(re.findall(r"gl_FragData\[(\d)\]|TARGET\((\d)\)",
                                                           text)))}
    if refused := re.search(r"refused: (.*)|Compiler Error:\n(.*)", said):
        return {**found, "refused": (refused[1] or refused[2]).strip()}
    if "FRAG" in said:
        found.update(_operations(said))
    if counts := _RADEON.search(said):
        number = {name: int(value) for value, name in _COUNT.findall(counts["counts"])}
        found.update(arithmetic=number["inst"] - number["tex"] - number["flowcontrol"],
                     vector=number["vinst"], scalar=number["sinst"], fetches=number["tex"],
                     registers=number["temps"], cycles=number["cycles"], listing=_pairs(said))
    elif counts := _G80.search(said):
        found.update(arithmetic=int(counts["inst"]), scalar=int(counts["inst"]),
                     registers=int(counts["gpr"]))
    elif "FRAG" not in said:
        raise SystemExit(f"{card}'s driver printed no counts: {said[-500:]}")
    return found


def _pairs(said: str) -> str:
    """Return a program's listing for R300 to R580: pairs of vector and scalar operations."""
    last = said.rindex(_LAST_STEP) + len(_LAST_STEP)
    lines = itertools.takewhile(lambda line: line[:1] in ("#", " "), said[last:].splitlines())
    return "\n".join(line for line in lines if not line.startswith("#"))


def _operations(said: str) -> dict[str, Any]:
    """Return a program's counts from its listing in TGSI.

    ``arithmetic`` counts the instructions that NV40's driver emits, without fetches. The driver
    never pairs operations in one instruction, although NV40 can execute pairs. ``levels`` is the
    longest chain of dependent fetches.
    """
    listing = said[said.index("FRAG"):].split("\n\n")[0].strip("\n")
    operations = [match for match in _TGSI.finditer(listing) if match["op"] != "END"]
    fetches = [one for one in operations if one["op"].startswith("TEX")]
    level: dict[str, int] = {}
    for one in operations:
        target, *sources = one["rest"].split(", ")
        height = max((level.get(number, 0) for source in sources
                      for number in _TEMP.findall(source)), default=0)
        if one in fetches:
            height += 1
        for number in _TEMP.findall(target):
            level[number] = max(height, level.get(number, 0) if "." in target else 0)
    declared = re.search(r"DCL TEMP\[(\d+)(?:\.\.(\d+))?\]", listing)
    registers = 0 if declared is None else int(declared[2] or declared[1]) + 1
    issued = sum(_nv40_instructions(one["op"], one["rest"]) for one in operations)
    return {"arithmetic": issued - len(fetches), "fetches": len(fetches),
            "levels": max(level.values(), default=0), "registers": registers, "listing": listing}


def _nv40_instructions(operation: str, operands: str) -> int:
    """Return the number of instructions that NV40's driver emits for an operation.

    An NV40 instruction reads a single constant and a single input. The driver first copies further
    constants and inputs to registers.
    """
    sources = operands.split(", ")[1:]
    copies = 0
    for kind in (_INPUT, _CONSTANT):
        read = [found[0] for found in map(kind.search, sources) if found]
        copies += sum(name != read[0] for name in read)
    return _INSTRUCTIONS.get(operation, 1) + copies


def write(card: str, drivers: Path, programs: Iterable[static_costs.EraProgram]) -> None:
    entries, driver = {}, ""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "program.frag"
        for program in programs:
            path.write_text(program.text)
            said = run(drivers, card, path, listing=True)
            driver = driver or said[said.index("driver: ") + 8:].splitlines()[0]
            cost = cost_of(card, said, program.text)
            if card == "g80" and "refused" not in cost:
                # G80's driver prints no counts of fetches and levels: use NV40's counts.
                other = cost_of("nv40", run(drivers, "nv40", path), program.text)
                cost.update(fetches=other["fetches"], levels=other["levels"])
            entries[program.digest] = {"method": program.method, "kernel": program.kernel, **cost}
    data = {"driver": driver, "date": datetime.date.today().isoformat(), "programs": entries}
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{card}.json").write_text(json.dumps(data, indent=1) + "\n")
    refused = sum("refused" in entry for entry in entries.values())
    print(f"{card}: {len(entries)} kernels, {refused} refused; {driver}")


def main() -> None:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drivers", required=True, type=Path, metavar="FOLDER")
    parser.add_argument("--card", action="append", choices=static_costs.COMPILERS)
    chosen = parser.parse_args()
    programs = static_costs.all_era_programs()
    for card in chosen.card or static_costs.COMPILERS:
        write(card, chosen.drivers, programs)


if __name__ == "__main__":
    main()
