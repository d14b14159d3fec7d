"""Sampling and Fresnel terms: GLSL is compared with float64, and both are compared with known sums
and limits."""
from __future__ import annotations

import numpy as np
import pytest
from probing import evaluate

from gpgpu_rt.reference import sampling
from gpgpu_rt.reference.random_numbers import random_numbers

ULP = 2.0 ** -23


def random_pairs(count: int) -> np.ndarray:
    """Return (count, 2) random numbers of paths, including values next to 0, 1/2 and 1."""
    numbers = random_numbers(np.arange(count), 11, 0, 1, 0)[:, :2]
    edges = np.array([1, 3, (1 << 23) - 1, (1 << 23) + 1,
                     (1 << 24) - 3, (1 << 24) - 1]) / (1 << 24)
    numbers[:36] = np.stack(np.meshgrid(edges, edges), axis=-1).reshape(-1, 2)
    return numbers


def with_exponent(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random pairs, and float32 exponents from 0 to the exponent of the least roughness."""
    exponents = np.float32(np.r_[0, 1, 2, 48, 19998, 10 ** np.linspace(-1, 4.3, 200)])
    return random_pairs(count), np.resize(exponents, count)


@pytest.mark.small
def test_cosine_directions() -> None:
    numbers = random_pairs(20_000)
    found = evaluate("sample", "result = vec4(sample_cosine(x.xy), 0.0);", np.float32(numbers))
    expected = sampling.sample_cosine(numbers)
    assert np.abs(found[:, :3] - expected).max() < 3 * ULP
    # The relative error of the cosine is small even for grazing directions, because no digits
    # cancel.
    assert np.abs(found[:, 2] / expected[:, 2] - 1).max() < 4 * ULP


@pytest.mark.small
def test_lobe_directions() -> None:
    numbers, exponents = with_exponent(20_000)
    found = evaluate("sample", "result = vec4(sample_lobe(x.xy, x.z), 0.0);",
                     np.column_stack([np.float32(numbers), exponents]))[:, :3]
    expected = sampling.sample_lobe(numbers, exponents.astype(np.float64))
    assert np.abs(found - expected).max() < 8 * ULP
    sine, exact = np.hypot(*found[:, :2].T.astype(np.float64)), np.hypot(*expected[:, :2].T)
    assert np.abs(sine / exact - 1).max() < 8 * ULP


@pytest.mark.small
def test_lobe_density() -> None:
    numbers, exponents = with_exponent(20_000)
    cosine = np.float32(1 - numbers[:, 0] ** 4)
    cosine[:5] = (-0.5, -0.0, 1, 0.25, 0.9999999)
    found = evaluate("sample", "result = vec4(lobe_density(x.x, x.y), cosine_density(x.x), 0, 0);",
                     np.column_stack([cosine, exponents]))
    expected = sampling.lobe_density(cosine.astype(np.float64), exponents.astype(np.float64))
    # The density contains exp(-size), whose error is about `size` ulps. If the expected density is
    # below 1e-30, the test checks only that the result is tiny.
    size = exponents * -np.log(np.clip(cosine, 1e-30, 1))
    small = (expected < 1e-30) | (cosine <= 0)
    assert (found[small, 0] < 1e-29).all()
    error = np.abs(found[~small, 0] / expected[~small] - 1)
    assert (error < (8 + 4 * size[~small]) * ULP).all()
    assert np.abs(found[:, 1] - sampling.cosine_density(cosine.astype(np.float64))).max() < ULP


@pytest.mark.small
def test_triangle_points() -> None:
    numbers = random_pairs(20_000)
    found = evaluate("sample", "result = vec4(sample_triangle(x.xy), 0.0, 0.0);",
                     np.float32(numbers))
    assert np.abs(found[:, :2] - sampling.sample_triangle(numbers)).max() < 2 * ULP
    assert (found[:, :2] > 0).all() and found[:, :2].sum(axis=1).max() <= 1


@pytest.mark.small
@pytest.mark.parametrize("seed", [5])
def test_frames_are_orthonormal(seed: int) -> None:
    z = np.random.default_rng(seed).normal(size=(20_000, 3))
    z[:8] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1e-4, 0, -1], [0, 1e-4, -1],
             [1e-20, 0, -1], [1, 1, -1e-9]]
    z = np.float32(z / np.linalg.norm(z, axis=1, keepdims=True))
    found = np.stack([evaluate("sample", f"result = vec4(frame_around(x.xyz)[{axis}], 0.0);", z)
                      [:, :3] for axis in range(3)], axis=1).astype(np.float64)
    assert np.abs(found @ found.transpose(0, 2, 1) - np.eye(3)).max() < 8 * ULP
    assert (np.linalg.det(found) > 0).all()
    assert np.abs(found - sampling.frames_around(z.astype(np.float64))).max() < 8 * ULP


def cosines_and_iors() -> tuple[np.ndarray, np.ndarray]:
    """Return cosines and refractive indices that cover all kinds of refraction.

    There are grazing rays, perpendicular rays, and rays next to and beyond the critical angle. The
    rays enter and leave glass, water, diamond, a medium of index 1.0003, and a medium of index 10.
    """
    iors = np.float32([1.5, 1 / 1.5, 1.33, 1 / 1.33, 2.42, 1 / 2.42, 1.0003, 1 / 1.0003, 10, 0.1])
    cosines = np.float32(np.r_[np.linspace(1e-6, 1, 2000), 10.0 ** -np.arange(7), 1.0])
    cosine, ior = (a.ravel() for a in np.meshgrid(cosines, iors))
    return cosine, ior


@pytest.mark.small
def test_fresnel() -> None:
    cosine, ior = cosines_and_iors()
    found = evaluate("fresnel", "result = vec4(fresnel(x.x, x.y), 0.0, 0.0, 0.0);",
                     np.column_stack([cosine, ior]))[:, 0]
    c, n = cosine.astype(np.float64), ior.astype(np.float64)
    expected = sampling.fresnel(c, n)
    assert found.min() >= 0 and found.max() <= 1
    # `known` is the largest change of the result if cosine and ior change by a rounding unit. This
    # change is large near the critical angle.
    known = np.maximum.reduce([np.abs(sampling.fresnel(c * (1 + a), n * (1 + b)) - expected)
                               for a in (-ULP, 0, ULP) for b in (-ULP, 0, ULP)])
    assert (np.abs(found - expected) <= 16 * ULP * expected + 4 * known).all()
    ordinary = known < 1e-4 * expected
    assert ordinary.mean() > 0.75           # at index 1.0003, rounding dominates
    assert (np.abs(found - expected)[ordinary] < 1e-4).all()
    # Known textbook values.
    some = np.float32([[1, 1.5], [1, 1 / 1.5], [0.5, 1 / 1.5], [np.cos(np.arctan(1.5)), 1.5]])
    upright, out, total, brewster = evaluate(
        "fresnel", "result = vec4(fresnel(x.x, x.y), 0.0, 0.0, 0.0);", some)[:, 0]
    assert abs(upright - 0.04) < 1e-7 and abs(out - 0.04) < 1e-7 and total == 1
    assert abs(brewster - 0.5 * ((1.5 ** 2 - 1) / (1.5 ** 2 + 1)) ** 2) < 1e-7


@pytest.mark.small
@pytest.mark.parametrize("seed", [6])
def test_refraction_obeys_snell(seed: int) -> None:
    cosine, ior = cosines_and_iors()
    c, n = cosine.astype(np.float64), ior.astype(np.float64)
    through = (1 - c ** 2) / n ** 2 < 0.999
    c, n = c[through], n[through]
    sine = np.sqrt(1 - c ** 2)
    d = np.float32(np.column_stack([sine, np.zeros_like(c), -c]))
    found = evaluate("fresnel",
                     "vec3 d = vec3(x.x, 0.0, x.y);"
                     "result = vec4(refracted(d, vec3(0, 0, 1), -d.z, x.z), 0.0);",
                     np.column_stack([d[:, 0], d[:, 2], n]).astype(np.float32)
                     )[:, :3].astype(np.float64)
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 4 * ULP
    assert np.abs(found[:, 0] * n - sine).max() < 1e-6 and (found[:, 2] < 0).all()
    expected = sampling.refracted(d.astype(np.float64), np.array([[0, 0, 1.0]]), n)
    assert np.abs(found - expected).max() < 1e-5
    rng = np.random.default_rng(seed)   # Snell's law holds for any orientation of the surface
    normal = rng.normal(size=(1000, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    d = rng.normal(size=(1000, 3))
    d -= np.maximum((d * normal).sum(1, keepdims=True), 0) * 2 * normal
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    t = sampling.refracted(d, normal, 1.5)
    assert np.abs(np.cross(d, normal) - 1.5 * np.cross(t, normal)).max() < 1e-12


def sphere_grid(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 3) directions of the upper hemisphere, and the solid angle of each."""
    cosine = (np.arange(steps) + 0.5) / steps
    angle = 2 * np.pi * (np.arange(16) + 0.5) / 16
    cosine, angle = (a.ravel() for a in np.meshgrid(cosine, angle))
    sine = np.sqrt(1 - cosine ** 2)
    return (np.column_stack([sine * np.cos(angle), sine * np.sin(angle), cosine]),
            np.full(len(cosine), np.pi / 8 / steps))


@pytest.mark.parametrize("exponent", [0.0, 1.0, 12.5, 300.0])
def test_densities_integrate_to_one(exponent: float) -> None:
    d, weight = sphere_grid(50_000)
    assert abs((sampling.cosine_density(d[:, 2]) * weight).sum() - 1) < 1e-6
    assert abs((sampling.lobe_density(d[:, 2], exponent) * weight).sum() - 1) < 1e-5


@pytest.mark.parametrize("exponent", [None, 0.0, 12.5, 300.0])
def test_samples_follow_their_density(exponent: float | None) -> None:
    """200,000 directions pass a chi-square test with 8 x 16 cells of equal probability."""
    numbers = random_numbers(np.arange(200_000), 0, 0, 2, 3)[:, :2]
    if exponent is None:
        d, power = sampling.sample_cosine(numbers), 2.0
    else:
        d, power = sampling.sample_lobe(numbers, exponent), exponent + 1
    height = np.clip(8 * d[:, 2] ** power, 0, 7.999).astype(int)
    turn = (8 * (1 + np.arctan2(d[:, 1], d[:, 0]) / np.pi)).astype(int) % 16
    counts = np.bincount(height * 16 + turn, minlength=128)
    expected = len(d) / 128
    assert abs(((counts - expected) ** 2).sum() / expected - 127) < 5 * np.sqrt(2 * 127)


def test_triangle_points_are_uniform() -> None:
    u, v = sampling.sample_triangle(random_numbers(np.arange(160_000), 1, 0, 2, 3)[:, :2]).T
    assert (u + v <= 1).all()
    # Quarters of the barycentric weights give sixteen triangles of equal area.
    cells = (4 * u).astype(int) * 64 + (4 * v).astype(int) * 8 + (4 * (1 - u - v)).astype(int)
    counts = np.unique(cells, return_counts=True)[1]
    assert len(counts) == 16
    assert (((counts - 10_000) ** 2).sum() / 10_000 - 15) < 5 * np.sqrt(30)


@pytest.mark.parametrize("ior", [1.5, 1 / 1.5, 2.42])
def test_reflection_is_the_same_from_both_sides(ior: float) -> None:
    """A surface reflects the same share of light from both sides (Stokes). Light from the other
    side comes along the refracted ray."""
    cosine = np.linspace(0.01, 1, 500)
    through = 1 - (1 - cosine ** 2) / ior ** 2
    some = through > 0
    back = sampling.fresnel(np.sqrt(through[some]), 1 / ior)
    assert np.abs(back - sampling.fresnel(cosine[some], ior)).max() < 1e-12
    assert (sampling.fresnel(cosine[~some], ior) == 1).all()
