"""Helpers for tests of the viewer without a window. The fixtures of these tests are in
tests/conftest.py."""
from __future__ import annotations

import pytest

import gpgpu_rt as rt
from gpgpu_rt.viewer import Viewer

METHODS = [row.name for row in rt.methods()]


def full(*values: object):
    return pytest.param(*values, marks=pytest.mark.full)


def settle(viewer: Viewer, steps: int = 30) -> None:
    """Steps the viewer, whose camera is at rest, until the picture is complete."""
    viewer.clock.now += 1.0
    for _ in range(steps):
        viewer.step()
        if viewer.finished:
            return
    raise AssertionError(f"not finished after {steps} steps: {viewer.message}")
