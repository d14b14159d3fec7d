"""In the past, trimesh_ray failed if a direction was so short that t overflows float32. The module
returned NaN locations, and reported the two sides of a box as one hit."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh

from gpgpu_rt.trimesh_ray import RayMeshIntersector


@pytest.mark.filterwarnings("error")
def test_places_on_a_ray_with_a_short_direction() -> None:
    with RayMeshIntersector(trimesh.creation.box()) as ray:
        places, rays, _ = ray.intersects_location([[0.2, 0.3, 2]], [[0, 0, -1e-41]])
    assert rays.tolist() == [0, 0]
    assert np.allclose(places, [[0.2, 0.3, 0.5], [0.2, 0.3, -0.5]], rtol=0, atol=1e-6)
