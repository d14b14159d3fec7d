"""Accelerators: builders in pure numpy, from triangles to arrays; no OpenGL here."""
from __future__ import annotations

from .bvh import Bvh, OctantCopies, build_bvh
from .cache import cached
from .grid import Grid, build_grid
from .kdtree import LEAF as KD_LEAF_AXIS
from .kdtree import KdTree, build_kdtree
from .proximity import proximity
from .quality import quality, sah_cost
from .ropes import Ropes, build_ropes
