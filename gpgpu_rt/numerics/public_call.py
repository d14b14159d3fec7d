"""public_call: a decorator for public functions that compute with arrays."""
from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from ..errors import memory_limited
from .denormals import keeps_denormals

Given = ParamSpec("Given")
Made = TypeVar("Made")


def public_call(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Decorate a public function: a lack of memory raises LimitError, and denormals are kept."""
    return keeps_denormals(memory_limited(function))
