"""Every ray against every triangle."""
from __future__ import annotations

from ...traversal.triangle_table import box_uniforms, triangle_table  # for methods of one's own
