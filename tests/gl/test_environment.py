"""Tests of the environment that measurements record."""
from __future__ import annotations

import importlib.metadata
from dataclasses import asdict
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl import environment
from gpgpu_rt.gl.context import open_gpu


def test_the_environment_names_program_and_renderer() -> None:
    found = environment.environment()
    assert found.version == rt.__version__ and found.libraries["moderngl"]
    assert (found.renderer, found.opengl) == (open_gpu().renderer, open_gpu().version)
    assert all(value for name, value in asdict(found).items() if name != "commit")


def test_a_checkout_need_not_be_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    found = environment.environment()
    assert found.version == rt.__version__ and not found.libraries


def test_a_repository_around_an_installed_package_gives_no_commit(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The commit of a user's own repository, in which the package is installed, is not
    recorded."""
    checkout = Path(rt.__file__).parents[1]
    monkeypatch.setattr(environment, "_ROOT", checkout / "gpgpu_rt")
    assert environment.commit.__wrapped__() is None
    (tmp_path / ".git").mkdir()     # an empty folder is no repository
    monkeypatch.setattr(environment, "_ROOT", tmp_path)
    assert environment.commit.__wrapped__() is None
