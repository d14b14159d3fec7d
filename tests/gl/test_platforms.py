"""Tests of the contexts that the package requests on each operating system. The tests imitate
Windows and macOS, and need neither."""
from __future__ import annotations

import functools
import subprocess
import sys
from typing import Any

import moderngl
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.gl import context as contexts


class FakeContext:
    """Imitates the context of a driver with OpenGL 4.1."""

    version_code, extra = 410, None
    info = {"GL_RENDERER": "Apple M2", "GL_VERSION": "4.1", "GL_MAX_TEXTURE_SIZE": 16384,
            "GL_MAX_DRAW_BUFFERS": 8}

    def __exit__(self, *exception: Any) -> None:
        pass


@pytest.fixture
def asked(monkeypatch) -> list[dict[str, Any]]:
    """Returns a list that collects the arguments of each request for a context. Requests fail."""
    found: list[dict[str, Any]] = []

    def refuse(**settings: Any) -> None:
        found.append(settings)
        raise Exception("no driver")
    monkeypatch.setattr(moderngl, "create_context", refuse)
    monkeypatch.setattr(contexts.OsMesaLoader, "__init__", lambda self: None)
    monkeypatch.setattr(contexts, "_made", functools.lru_cache(contexts._made.__wrapped__))
    for name in ("GPGPU_RT_CONTEXT", "GPGPU_RT_EGL_DEVICE", "GALLIUM_DRIVER"):
        monkeypatch.delenv(name, raising=False)
    return found


@pytest.mark.parametrize("platform", ["win32", "darwin"])
@pytest.mark.parametrize("choice", [None, "auto", "native"])
def test_windows_and_macos_use_native_contexts(asked, monkeypatch, platform: str,
                                               choice: str | None) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    with pytest.raises(rt.ContextError, match="no driver.*install the driver of the graphics"):
        contexts.open_gpu(choice)
    assert asked == [{"standalone": True, "require": 330}]


def test_linux_asks_for_egl_first(asked, monkeypatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(Exception):
        contexts.open_gpu("auto")
    assert asked[0] == {"standalone": True, "backend": "egl", "require": 330}
    assert isinstance(asked[1]["context"], contexts.OsMesaLoader) and len(asked) == 2
    with pytest.raises(rt.OptionError, match="none of auto, egl, osmesa, angle"):
        contexts.open_gpu("native")


def test_a_context_of_the_system_is_used(asked, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(moderngl, "create_context", lambda **settings: FakeContext())
    gpu = contexts.open_gpu()
    assert gpu.backend == "native" and not gpu.is_es and contexts.open_gpu("native") is gpu
    with pytest.raises(rt.OptionError, match="none of auto, native, angle"):
        contexts.open_gpu("egl")


def test_info_names_the_backends_of_the_system(asked, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(contexts, "_create_angle", contexts._create_native)
    assert cli.main(["info"]) == 1
    out, err = capsys.readouterr()
    assert out.startswith("native: not available (win32 gives no OpenGL 3.3 context (no driver)")
    assert err == ("gpgpu-rt: no OpenGL context is available; install the driver of the graphics "
                   "card, then try `gpgpu-rt info`\n")


def test_commands_need_no_module_of_unix() -> None:
    """Every command can be imported without the modules of Unix below, which Windows lacks."""
    code = ("import sys\n"
            "for name in ('fcntl', 'grp', 'pwd', 'resource', 'termios'):\n"
            "    sys.modules[name] = None\n"
            "from gpgpu_rt.cli.main import import_command\nimport_command([])\nprint('imported')")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "imported\n", done.stderr
