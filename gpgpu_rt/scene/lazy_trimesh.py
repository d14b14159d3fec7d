"""Lazy trimesh: imports the library trimesh at its first use.

Importing trimesh takes as long as rendering a small picture, and built-in scenes do not need it.
"""
from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import trimesh
else:
    class _Lazy:
        def __getattr__(self, name: str) -> Any:
            return getattr(importlib.import_module("trimesh"), name)

    trimesh = _Lazy()

__all__ = ["trimesh"]
