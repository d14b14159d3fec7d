"""Construction by fragment passes.

The host uploads triangles, decides how many passes there are, and reads the finished structure
back once.
"""
from __future__ import annotations

from .bvh import GPU_BUILDS, build_bvh
from .kdtree import GPU_KD_BUILDS, build_kdtree
