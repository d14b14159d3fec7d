"""NV40 pairing: counts the clocks in which a pipe of the GeForce 6800 issues a compiled kernel.

A pipe has two units. In a clock, the first unit multiplies, computes a special function or fetches
a texel, and the second unit multiplies and adds, or compares. Each unit can split its four
components between two independent operations, as 3 + 1 or 2 + 2 (E. Kilgariff and R. Fernando, GPU
Gems 2, chapter 30; tweakers.net 2004-08-21 on 3DCenter's article). Mesa's driver pairs no
operations. `clocks` schedules the operations of the driver's listing as early as their operands
allow. The machine model adds the clocks of fetches. No source says that the second unit can use a
result of the first unit in the same clock, so `clocks` does not assume this.
"""
from __future__ import annotations

import functools
import re
from dataclasses import dataclass

FIRST, SECOND = 0, 1
COMPONENTS = 4      # of a unit
# SPECIAL: operations of the first unit. EITHER: operations of either unit (a copy is a product
# with 1). The second unit runs all other operations.
SPECIAL, EITHER = ("RCP", "RSQ", "EX2", "LG2", "SIN", "COS"), ("MUL", "MOV")
_LINE = re.compile(r"^\s*\d+: *(\w+) ([A-Z]+\[\d+\])(?:\.([xyzw]+))?, (.*)$", re.M)
_OPERAND = re.compile(r"([A-Z]+\[\d+\](?:\[\d+\])?)(?:\.([xyzw]+))?")
FETCH = "TEX"
_WHOLE = ("DP2", "DP3", "DP4", FETCH)     # operations that read all components of their operands
_CONDITION = "CC"     # the condition register, which a selection sets


@dataclass(frozen=True)
class ListedOperation:
    """An operation of a listing.

    Attributes
    ----------
    name : mnemonic
    reads, writes : components such as "TEMP[3].x"
    width : number of computed components
    """

    name: str
    reads: frozenset[str]
    writes: frozenset[str]
    width: int


def operations(listing: str) -> list[ListedOperation]:
    """Return the operations of NV40's listing. A selection (CMP) becomes three operations, as in
    Mesa's driver: a copy that sets the condition, a copy, and a conditional copy."""
    found = []
    for name, register, mask, operands in _LINE.findall(listing):
        mask = mask or "xyzw"
        writes = _components(register, mask)
        each = [_read(name, *operand, mask) for operand in _OPERAND.findall(operands)]
        if name == "CMP":
            condition, chosen, other = each
            sets = frozenset(f"{_CONDITION}.{letter}" for letter in mask)
            found += [ListedOperation("MOV", condition, sets, len(mask)),
                      ListedOperation("MOV", other, writes, len(mask)),
                      ListedOperation("MOV", chosen | sets, writes, len(mask))]
        else:
            found.append(ListedOperation(name, frozenset().union(*each), writes, len(mask)))
    return found


def _components(register: str, letters: str) -> frozenset[str]:
    return frozenset(f"{register}.{letter}" for letter in letters)


def _read(name: str, register: str, swizzle: str, mask: str) -> frozenset[str]:
    swizzle = swizzle or "xyzw"
    if name in SPECIAL:
        return _components(register, swizzle[0])
    if name in _WHOLE:
        return _components(register, swizzle)
    return _components(register, "".join(swizzle["xyzw".index(letter)] for letter in mask))


def arithmetic_of(listing: str) -> list[ListedOperation]:
    return [one for one in operations(listing) if one.name != FETCH]


@functools.cache
def clocks(listing: str) -> int:
    """Return the number of clocks in which a pipe issues a listing's arithmetic."""
    ready: dict[str, int] = {}     # component -> first clock that may read it
    last_read: dict[str, int] = {}     # component -> last clock that reads it
    used: dict[tuple[int, int], list[int]] = {}     # (clock, unit) -> widths of operations
    end = 0
    for one in operations(listing):
        start = max([ready.get(name, 0) for name in one.reads | one.writes]
                    + [last_read.get(name, 0) for name in one.writes], default=0)
        if one.name == FETCH:
            at = start      # the machine model counts the fetch's own clock
        else:
            at = next(clock for clock in range(start, start + 10_000)
                      if _issue(one, clock, used))
            end = max(end, at + 1)
        for name in one.reads:
            last_read[name] = max(last_read.get(name, 0), at)
        for name in one.writes:
            ready[name] = at + (one.name != FETCH)
    return end


def _issue(one: ListedOperation, clock: int, used: dict[tuple[int, int], list[int]]) -> bool:
    """Try to issue the operation in this clock. Return whether a unit had free components."""
    units = ((FIRST,) if one.name in SPECIAL else (FIRST, SECOND) if one.name in EITHER
             else (SECOND,))
    for unit in units:
        widths = used.setdefault((clock, unit), [])
        if len(widths) < 2 and sum(widths) + one.width <= COMPONENTS:
            widths.append(one.width)
            return True
    return False
