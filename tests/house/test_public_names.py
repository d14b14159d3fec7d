"""Every public class, function, property and module has a description, and a user's mistake raises
an error of one line."""
from __future__ import annotations

import contextlib
import inspect
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli, trimesh_ray
from gpgpu_rt.cli import tracing
from gpgpu_rt.render import path as path_tracing


def public() -> Iterator[tuple[str, Any]]:
    """Yields every public name with its object, including the members of public classes."""
    owners = {"rt": rt, "rt.reference": rt.reference, "trimesh_ray": trimesh_ray}
    for prefix, module in owners.items():
        for name in module.__all__:
            thing = getattr(module, name)
            yield f"{prefix}.{name}", thing
            if not inspect.isclass(thing):
                continue
            for base in thing.__mro__:
                if base.__module__.startswith("gpgpu_rt"):
                    for inner, member in vars(base).items():
                        if not inner.startswith("_"):
                            yield f"{prefix}.{name}.{inner}", getattr(member, "__func__", member)


DESCRIBED = {name: thing for name, thing in public() if callable(thing)
             or isinstance(thing, property) or inspect.ismodule(thing)}


def undescribed(name: str, thing: Any) -> list[str]:
    """Returns the parts that the docstring does not describe: the object itself, or parameters."""
    text = inspect.getdoc(thing)
    # A dataclass without a docstring gets a text that begins with the class's name and a bracket.
    if not text or text.startswith(f"{name.rpartition('.')[2]}("):
        return ["what it is"]
    if not inspect.isfunction(thing):
        return []
    return [one for one in inspect.signature(thing).parameters
            if one not in ("self", "cls") and not re.search(rf"\b{one}\b", text)]


@pytest.mark.parametrize("name", DESCRIBED)
def test_every_public_name_is_described(name: str) -> None:
    assert undescribed(name, DESCRIBED[name]) == []


def test_missing_descriptions_are_found() -> None:
    """`undescribed` finds a function without a docstring, and a parameter without a
    description."""
    def bare(x): ...

    def half(x, y):
        """Describes x alone."""
    assert len(DESCRIBED) > 70
    assert undescribed("bare", bare) == ["what it is"] and undescribed("half", half) == ["y"]


@pytest.mark.parametrize("call, message", [
    (lambda tracer: tracer.render(camera="front"), "camera is 'front'; give a Camera"),
    (lambda tracer: tracer.eye_hits(camera=3), "camera is 3; give a Camera"),
    (lambda tracer: tracer.render(size="big"), "size is 'big'"),
    (lambda tracer: tracer.render(integrator="pth"), "did you mean path"),
    (lambda tracer: tracer.render(colour="red"), "has no option 'colour'"),
    (lambda tracer: rt.load_scene(3), "cannot load a scene from int")],
    ids=["camera", "eye camera", "size", "integrator", "option", "scene"])
def test_mistakes_in_python_are_one_line(call, message: str) -> None:
    with rt.Tracer("cornell") as tracer, pytest.raises(rt.Error, match=re.escape(message)) as told:
        call(tracer)
    assert "\n" not in str(told.value)


class Interrupted:
    """Raises KeyboardInterrupt, like Ctrl-C, once ``after`` samples are done."""

    def __init__(self, after: int) -> None:
        self.after = after

    def __call__(self, done: int, samples: int, noise: float) -> None:
        if done >= self.after:
            raise KeyboardInterrupt


def test_an_interrupted_picture_is_kept(monkeypatch) -> None:
    monkeypatch.setattr(path_tracing, "WAVE", 4 * 16 * 16)
    with rt.Tracer("cornell-light") as tracer:
        whole = np.asarray(tracer.render(size=(16, 16), integrator="path", samples=32), float)
        with pytest.raises(KeyboardInterrupt):
            tracer.render(size=(16, 16), integrator="path", samples=32, progress=Interrupted(16))
        part = tracer.unfinished()
        assert tracer.statistics.samples == 16 and part.size == (16, 16)
        assert abs(np.asarray(part, float).mean() - whole.mean()) < 0.1 * whole.mean()
        again = np.asarray(tracer.render(size=(16, 16), integrator="path", samples=32), float)
        assert (again == whole).all()  # no sample of the interrupted picture remains
        monkeypatch.setattr(type(tracer.sessions.pictures.integrator), "_take_samples", _interrupt)
        with pytest.raises(KeyboardInterrupt):
            tracer.render(size=(16, 16), integrator="path", samples=32)
        assert tracer.unfinished() is None


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


def test_an_interrupted_command_writes_the_finished_samples(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setattr(path_tracing, "WAVE", 4 * 16 * 16)
    monkeypatch.setattr(tracing, "progress_shown",
                        lambda: contextlib.nullcontext(Interrupted(8)))
    target = tmp_path / "part.png"
    arguments = ["render", "cornell-light", "--integrator", "path", "--samples", "32", "--size",
                 "16", "-o", str(target)]
    assert cli.main(arguments) == 130
    out, err = capsys.readouterr()
    assert "before the interrupt" in out and "8 samples per pixel" in out
    assert "interrupted" not in err
    with Image.open(target) as image:
        assert np.asarray(image).any()
