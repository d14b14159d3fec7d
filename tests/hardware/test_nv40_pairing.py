"""Tests of the number of clocks in which a fragment pipeline of the GeForce 6800 issues the
operations of an assembly listing."""
from __future__ import annotations

import pytest

from gpgpu_rt.hardware.machine_model import issue_slots
from gpgpu_rt.hardware.nv40_pairing import arithmetic_of, clocks
from gpgpu_rt.hardware.static_costs import compiled_costs


def _listing(*lines: str) -> str:
    return "\n".join(f"  {number}: {line}" for number, line in enumerate((*lines, "END")))


def _independent(name: str, *masks: str, operands: str = "IN[0].xyzw, IN[1].xyzw") -> str:
    """Return a listing of independent operations with the same name, one for each mask."""
    return _listing(*(f"{name} TEMP[{at}].{mask}, {operands}" for at, mask in enumerate(masks)))


@pytest.mark.parametrize("name, masks, expected", [
    ("ADD", ("xyzw", "xyzw"), 2), ("ADD", ("xyz", "x"), 1), ("ADD", ("xy", "xy"), 1),
    ("ADD", ("xyz", "xy"), 2), ("ADD", ("x", "x", "x"), 2),     # at most two share a unit
    ("MUL", ("xyzw", "xyzw"), 1), ("MUL", ("xyz", "x", "xyz", "x"), 1), ("MUL", ("xyzw",) * 3, 2),
    ("RCP", ("x", "x", "x"), 2)])
def test_two_units_split_between_two_operations(name, masks, expected) -> None:
    assert clocks(_independent(name, *masks)) == expected


def test_an_operation_waits_for_its_operands() -> None:
    chain = _listing("MUL TEMP[0].x, IN[0].xxxx, IN[0].xxxx",
                     "ADD TEMP[1].x, TEMP[0].xxxx, IN[0].xxxx",
                     "MUL TEMP[2].x, TEMP[1].xxxx, TEMP[0].xxxx")
    assert clocks(chain) == 3
    # Another component of the same register is independent.
    apart = chain.replace("TEMP[0].xxxx, IN[0]", "TEMP[0].yyyy, IN[0]")
    assert clocks(apart) == 2


def test_an_overwritten_register_waits_for_its_readers() -> None:
    late = "ADD TEMP[1].x, TEMP[0].xxxx, IN[0].xxxx"
    one = _listing("ADD TEMP[0].x, IN[0].xxxx, IN[0].xxxx", late, "MOV TEMP[0].x, IN[1].xxxx",
                   "MOV TEMP[2].x, TEMP[0].xxxx")
    # The copy may replace the register in the clock in which the register is read.
    assert clocks(one) == 3
    assert clocks(one.replace("MOV TEMP[0]", "MOV TEMP[3]")) == 2


def test_a_selection_is_three_operations() -> None:
    listing = _listing("CMP TEMP[0].x, -|IN[0].xxxx|, IN[1].xxxx, IN[2].xxxx")
    assert [one.name for one in arithmetic_of(listing)] == ["MOV"] * 3
    assert clocks(listing) == 2      # the condition and a copy, then the conditional copy


def test_fetches_take_no_clock_here() -> None:
    listing = _listing("TEX TEMP[0], IN[0].xyyy, SAMP[0], 2D",
                       "ADD TEMP[1].x, TEMP[0].wwww, IN[0].xxxx")
    assert clocks(listing) == 1


def test_every_kernel_is_issued_between_the_peak_and_one_operation_a_clock() -> None:
    for cost in compiled_costs("nv40").programs.values():
        operations = len(arithmetic_of(cost.listing))
        assert operations / 4 <= clocks(cost.listing) <= operations
        assert clocks(cost.listing) <= issue_slots(cost) <= cost.arithmetic
        # The driver emits a few copies that the listing lacks.
        assert cost.arithmetic - operations <= max(4, cost.arithmetic / 10), cost.kernel
