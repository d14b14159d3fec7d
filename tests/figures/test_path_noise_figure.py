"""The figure path_noise: its errors shrink with more samples, and its page path_noise.md names the
renderer of the reference picture. The reference picture's own noise is below the figure's
target."""
from __future__ import annotations

import numpy as np

from gpgpu_rt.figures.experiments import path_errors, path_noise
from gpgpu_rt.figures.framework import measure
from gpgpu_rt.figures.framework.cell import Cell


def test_errors_shrink_with_samples(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(path_errors, "FEWEST", 1)
    small = [Cell(path_noise.SCENE, path_noise.METHOD, (("sampler", sampler), ("samples", 4)), 64,
                  "path errors", 1) for sampler in path_noise.SAMPLERS]
    monkeypatch.setattr(path_noise, "cells", lambda full: small)
    measure.measure(small, tmp_path)
    path_noise.draw(tmp_path, tmp_path, False)
    rows = path_noise.rows(tmp_path, False)
    assert [row[:2] for row in rows] == [[sampler, samples] for sampler in ("random", "sobol")
                                         for samples in (1, 2, 4)]
    error = {tuple(row[:2]): row[2] for row in rows}
    for sampler in ("random", "sobol"):
        assert error[sampler, 4] < 0.8 * error[sampler, 1]
    assert "Mitsuba" in (tmp_path / "path_noise.md").read_text()
    assert (tmp_path / "path_noise.png").stat().st_size > 10_000


def test_the_reference_picture_s_noise_is_below_the_target() -> None:
    radiance, error = path_errors.cornell_truth()
    assert radiance.shape == error.shape == (64, 64, 3) and (radiance >= 0).all()
    assert 0 < path_errors.truth_noise() < path_noise.BARS["scene"]
    assert np.isfinite(error).all()
