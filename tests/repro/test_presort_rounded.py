"""In the past, the option `presort` left out all rays with t_max < t_min. Rounding to the
precision of the textures may make t_max and t_min equal, so that the ray has a valid interval.
Such rays were traced without `presort`, but not with `presort`."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt


@pytest.mark.parametrize("storage", ["fp16", "fp24", "fp32"])
@pytest.mark.parametrize("method", ["bvh-threaded", "bvh-packet"])
def test_presort_keeps_rays_whose_rounded_interval_is_valid(method: str, storage: str) -> None:
    scene = rt.Scene.from_arrays([[-1, -1, 1], [3, -1, 1], [-1, 3, 1]], [[0, 1, 2]])
    origins, directions = np.zeros((64, 3)), np.tile([0.0, 0.0, 1.0], (64, 1))
    found = []
    for presort in (False, True):
        with rt.Tracer(scene, method, storage=storage, presort=presort) as tracer:
            found.append(tracer.trace(origins, directions, t_min=1.00001, t_max=1.0).hit)
    assert (found[0] == found[1]).all() and found[0].all() == (storage == "fp16")
