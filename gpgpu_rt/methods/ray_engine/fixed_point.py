"""Fixed point: the number formats of cards of the Ray Engine's time (Carr, Hall and Hart 2002)."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class FixedPoint:
    """A card's fixed point: the multiples of ``step`` from ``least`` to ``most``.

    Attributes
    ----------
    half : half of the scene's largest side after scaling; the rest of the range is for origins
        outside of the scene's box, and for t
    """

    step: float
    least: float
    most: float
    half: float


# From hardware/cards.json: the R200 has three bits before the binary point and twelve behind it;
# the NV25's register combiners have a sign and eight bits.
FIXED_POINT = {"r200": FixedPoint(2.0 ** -12, -8.0, 8 - 2.0 ** -12, 1.0),
               "nv25": FixedPoint(1 / 255, -1.0, 1.0, 0.125)}


def fixed_uniforms(name: str | None, triangles: np.ndarray) -> dict[str, Any]:
    """Return the uniforms of ``fixed_point.glsl``, or an empty dictionary if ``name`` is None.

    Parameters
    ----------
    name : a name of FIXED_POINT, or None
    triangles : (n, 3, 3) float32, corners in world units
    """
    if name is None:
        return {}
    numbers = FIXED_POINT[name]
    lo, hi = triangles.min((0, 1)), triangles.max((0, 1))
    side = max(float((hi - lo).max()), np.finfo(np.float32).tiny)
    return {"fixed_centre": tuple(map(float, (lo + hi) / 2)),
            "fixed_scale": float(np.float32(2 * numbers.half / side)),
            "fixed_step": numbers.step, "fixed_least": numbers.least, "fixed_most": numbers.most}
