"""Tests of the meaning of records: each field of a state has an explanation, for all built-in
methods with a schedule other than `loop`."""
from __future__ import annotations

import re

import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.record import Record
from gpgpu_rt.inspect.record_meaning import meaning
from gpgpu_rt.methods import built_in_methods
from gpgpu_rt.traversal.records import STATE

ROWS = [row for row in built_in_methods() if row.schedules != ("loop",)]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_texts_name_each_field_of_a_state(row: rt.Method) -> None:
    states = [row.state]
    if row.packet_state is not None:
        with rt.Tracer("cornell", row.name) as tracer:
            states.append(row.packet_state(tracer.options).state)
    for state in states:
        text = " ".join({**meaning(state), **meaning(STATE)}.values())
        assert {field.name for field in state.fields} <= set(re.findall(r"`(\w+)`", text))


def test_texts_of_named_records_are_included() -> None:
    """`meaning` also returns the texts of the records that a text names."""
    state = next(row.state for row in ROWS if row.name == "kd-short-stack")
    assert [*meaning(state)] == ["KD_SHORT_STACK_STATE", "KD_PUSH_DOWN_STATE", "KD_STATE"]


def test_a_record_without_a_declaration_has_no_text() -> None:
    assert meaning(Record("state", "unknown")) == {}
