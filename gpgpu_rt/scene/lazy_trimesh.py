"""Lazy trimesh: imports the library trimesh at its first use.

The import of trimesh takes as long as rendering a small picture, and a built-in scene does not
need trimesh.
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
