"""Brute force: test every ray against every triangle."""
from __future__ import annotations

from ...traversal.triangle_table import box_uniforms, triangle_table  # for users' methods
