"""Tests that are skipped on ANGLE over SwiftShader, with their reasons."""
from __future__ import annotations

from collections.abc import Iterable

import pytest

# part of a test's name -> why the test is skipped
EXCEPTIONS: dict[str, str] = {}


def skip_exceptions(items: Iterable[pytest.Item]) -> None:
    """Mark the tests in ``EXCEPTIONS`` as skipped."""
    for item in items:
        for name, reason in EXCEPTIONS.items():
            if name in item.nodeid:
                item.add_marker(pytest.mark.skip(reason=reason))
