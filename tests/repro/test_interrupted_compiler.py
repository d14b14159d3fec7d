"""In the past, Ctrl-C during the compilation of a program ended the process with a segmentation
fault. moderngl calls Python from its compiler and does not expect an exception there."""
from __future__ import annotations

import signal
from pathlib import Path

import moderngl
import pytest

from gpgpu_rt.gl import shader
from gpgpu_rt.gl.context import Gpu
from gpgpu_rt.interrupts import deferred


def test_the_interrupt_waits_for_the_compiler(gpu: Gpu, monkeypatch: pytest.MonkeyPatch,
                                              tmp_path: Path) -> None:
    program = tmp_path / "white.frag"
    program.write_text("#version 330 core\nout vec4 colour;\n"
                       "void main() { colour = vec4(1.0); }\n")
    compiled = moderngl.Context.program
    made = []

    def interrupted(self: moderngl.Context, **texts: str) -> moderngl.Program:
        signal.raise_signal(signal.SIGINT)
        made.append(compiled(self, **texts))
        return made[-1]

    monkeypatch.setattr(moderngl.Context, "program", interrupted)
    monkeypatch.setattr(gpu, "programs", {})
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            shader.compile_program(gpu, str(program))
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(made) == 1


def test_an_ignored_interrupt_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with deferred():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
