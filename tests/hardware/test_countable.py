"""Instruction counts come from the text that a driver prints for debugging. Without a readable
text, one message says so, and everything else still works."""
from __future__ import annotations

import json
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.hardware import compiler
from gpgpu_rt.hardware.compiler import compiled, not_countable
from gpgpu_rt.hardware.counters import counted
from gpgpu_rt.hardware.program import NotCountable, parse
from gpgpu_rt.hardware.sample import emulated, program_of

TEXTS = {path.stem: path.read_text() for path in (Path(__file__).parent / "texts").iterdir()}
KNOWN = TEXTS["mesa-22.3"]
PROGRAM = ("#version 330\nin vec2 p; void main() { gl_Position = vec4(p, 0, 1); }",
           "#version 330\nout vec4 colour; void main() { colour = vec4(1); }")


def test_the_form_of_mesa_22_3_is_read() -> None:
    """The text of a loop with two exits is read. The loop has a fetch, a comparison, a product and
    two sums."""
    program = parse(KNOWN)
    assert program.loops == [1] and program.dependent_reads == 1
    assert program.outputs == {"colour": 0} and program.samplers == ["table"]
    assert program.uniforms == {0: ("count", "int"), 16: ("a", "vec4")}
    assert [dict(work.fetches) for work in program.work if work.fetches] == [{"table": 1}]
    assert program.flattened(1).vector == 10


# Texts in the formats of Mesa 23 to 25, and damaged texts. The parser must refuse each text rather
# than return wrong counts.
OTHERS = {
    "Mesa 25.0": TEXTS["mesa-25.0"],
    "values without ssa": KNOWN.replace("ssa_", "%"),
    "blocks renamed": KNOWN.replace("block block_", "block b"),
    "divergence in front": KNOWN.replace("vec4 32 ssa", "con 32x4 ssa"),
    "widths behind": KNOWN.replace("vec4 32 ssa_14", "32x4 ssa_14"),
    "intrinsics with an at sign": KNOWN.replace("intrinsic store_deref", "@store_deref"),
    "fetches without samplers": KNOWN.replace(", 0 (sampler)", ""),
    "constants without parentheses": KNOWN.replace("load_const (", "load_const "),
    "nothing": "", "cut short": KNOWN[:KNOWN.index("impl main")],
}


@pytest.mark.parametrize("text", OTHERS.values(), ids=OTHERS)
def test_another_form_is_the_one_condition(text: str) -> None:
    with pytest.raises(NotCountable, match="^no instruction counts: .*Mesa 22.3") as raised:
        parse(text)
    assert "\n" not in str(raised.value)


SAID = {"dies": ("", False), "is silent": ("", True), "cannot open a display": (
    "libEGL warning: no display\nContextError: no context\n", False)}


@pytest.mark.parametrize("said", SAID.values(), ids=SAID)
def test_a_driver_that_prints_nothing_is_the_same_condition(said, monkeypatch) -> None:
    monkeypatch.setattr(compiler, "_ask", lambda line: said)
    not_countable.cache_clear()
    try:
        assert not_countable().startswith("no instruction counts: ")
        with pytest.raises(NotCountable, match="no instruction counts"):
            compiled([PROGRAM])
    finally:
        not_countable.cache_clear()


def test_a_text_that_is_misread_is_noticed(monkeypatch) -> None:
    """A text that parses, but gives other counts than the known test program has, is reported as
    misread."""
    other = KNOWN.replace("txf", "fneg")
    monkeypatch.setattr(compiler, "_ask", lambda line: (
        f"{compiler._MARK}\nshader: MESA_SHADER_FRAGMENT\n{other}" * len(json.loads(line)), True))
    not_countable.cache_clear()
    try:
        assert not_countable().endswith("misread")
    finally:
        not_countable.cache_clear()


def test_mesa_22_3_can_be_counted(gpu) -> None:
    """Mesa 22.3 is countable. Otherwise every test that needs counts would be skipped
    unnoticed."""
    if "Mesa 22.3" not in gpu.version:
        pytest.skip(f"needs Mesa 22.3, this is {gpu.version}")
    assert not_countable() == ""


def test_what_needs_counts_raises_before_it_traces(uncountable: str) -> None:
    rays = rt.load_scene("cornell").camera.rays((16, 16))
    with rt.Tracer("cornell", "kd-restart") as tracer:
        traced = []
        with pytest.raises(NotCountable) as raised:
            counted(tracer, lambda: traced.append(tracer.trace(*rays)))
        assert str(raised.value) == uncountable and not traced
        with pytest.raises(NotCountable):
            emulated(tracer, *rays, tile=(16, 16))
        with pytest.raises(NotCountable):
            program_of(PROGRAM)
        assert tracer.trace(*rays).hit.any()
