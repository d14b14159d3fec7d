"""Accelerators: builders in pure numpy, from triangles to arrays; no OpenGL here."""
from __future__ import annotations

from .bih import Bih, build_bih
from .bvh import Bvh, build_bvh, node_limit
from .cache import cached, uncached
from .grid import Grid, build_grid
from .kdtree import LEAF as KD_LEAF_AXIS
from .kdtree import KdTree, build_kdtree
from .octant_copies import OctantCopies, times_stored
from .octree import Octree, build_octree
from .proximity import proximity
from .quality import quality, sah_cost
from .refit import REBUILD_RATIO, Refitter
from .ropes import Ropes, build_ropes
from .visibility_field import VisibilityField, build_visibility_field
