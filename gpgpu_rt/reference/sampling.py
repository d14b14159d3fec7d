"""Sampling of directions and points, Fresnel's equations and Snell's law, in float64.

``glsl/render/sample.glsl`` and ``glsl/render/fresnel.glsl`` do the same on the GPU and name the
papers. Densities are per steradian; random numbers lie in (0, 1).
"""
from __future__ import annotations

import numpy as np


def sample_cosine(random: np.ndarray) -> np.ndarray:
    """Return (n, 3) unit directions around z with density cosine / pi, from (n, 2) random
    numbers."""
    disc = _disc(random)
    return np.column_stack([disc, np.sqrt(np.maximum(1 - (disc * disc).sum(axis=1), 0))])


def cosine_density(cosine: np.ndarray) -> np.ndarray:
    """Return the density of `sample_cosine` at the given cosines of the angle to z."""
    return np.maximum(cosine, 0) / np.pi


def sample_lobe(random: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    """Return (n, 3) unit directions from (n, 2) random numbers, with density proportional to
    cos^exponent of the angle to z. ``exponent`` is (n,) or a number."""
    disc = _disc(random)
    radius_2 = (disc * disc).sum(axis=1)
    x = np.log1p(-radius_2) / (exponent + 1)
    return np.column_stack([disc * np.sqrt(-np.expm1(2 * x) / radius_2)[:, None], np.exp(x)])


def lobe_density(cosine: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    """Return the density of `sample_lobe` at the given cosines of the angle to z."""
    return (exponent + 1) / (2 * np.pi) * np.clip(cosine, 0, 1) ** exponent * (cosine > 0)


def sample_triangle(random: np.ndarray) -> np.ndarray:
    """Return (n, 2) barycentric weights of a triangle's second and third corner from (n, 2) random
    numbers, uniform by area."""
    s = np.sqrt(random[:, 0])
    return np.column_stack([s * (1 - random[:, 1]), s * random[:, 1]])


def frames_around(z: np.ndarray) -> np.ndarray:
    """Return orthonormal frames, (n, 3, 3). Row 2 of each frame is the given unit vector ``z``,
    (n, 3)."""
    sign = np.where(z[:, 2] < 0, -1.0, 1.0)
    a = -1 / (sign + z[:, 2])
    b = z[:, 0] * z[:, 1] * a
    x_axis = np.column_stack([1 + sign * z[:, 0] ** 2 * a, sign * b, -sign * z[:, 0]])
    y_axis = np.column_stack([b, sign + z[:, 1] ** 2 * a, -z[:, 1]])
    return np.stack([x_axis, y_axis, z], axis=1)


def fresnel(cosine: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """Return (n,) the share of unpolarised light that an interface reflects; 1 for total
    reflection.

    Parameters
    ----------
    cosine : (n,) cosine between the reversed incoming ray and the normal on the incoming side
    ior : (n,) or a number, the refractive index behind the interface over the index in front of it
    """
    sine_2 = (1 - cosine ** 2) / ior ** 2
    through = np.sqrt(np.maximum(1 - sine_2, 0))
    across = (cosine - ior * through) / (cosine + ior * through)
    along = (ior * cosine - through) / (ior * cosine + through)
    return np.where(sine_2 >= 1, 1.0, 0.5 * (across ** 2 + along ** 2))


def refracted(direction: np.ndarray, normal: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """Return (n, 3) refracted unit directions behind an interface, undefined where `fresnel` is 1.

    Parameters
    ----------
    direction : (n, 3) unit directions of the incoming rays
    normal : (n, 3) unit normals on the incoming side
    ior : (n,) or a number, as for `fresnel`
    """
    ior = np.reshape(ior, (-1, 1))
    cosine = -(direction * normal).sum(axis=1, keepdims=True)
    through = np.sqrt(np.maximum(1 - (1 - cosine ** 2) / ior ** 2, 0))
    return direction / ior + (cosine / ior - through) * normal


def _disc(random: np.ndarray) -> np.ndarray:
    """Return (n, 2) points of the unit disc, by the concentric map of (n, 2) random numbers."""
    at = 2 * np.asarray(random, np.float64) - 1
    across = np.abs(at[:, 0]) > np.abs(at[:, 1])
    r = np.where(across, at[:, 0], at[:, 1])
    angle = np.pi / 4 * np.where(across, at[:, 1], at[:, 0]) / r
    angle = np.where(across, angle, np.pi / 2 - angle)
    return r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
