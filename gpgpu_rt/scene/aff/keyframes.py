"""Key frames: motions by splines with tension, continuity and bias.

The splines are those of D. H. U. Kochanek and R. H. Bartels, "Interpolating Splines with Local
Tension, Continuity, and Bias Control", SIGGRAPH 1984. For rotations, the same formulas compute
tangents from the logarithms of the rotations between neighbouring keys. "Squad", a spherical cubic
interpolation, then gives the rotations between the keys (K. Shoemake, "Quaternion Calculus and
Fast Animation", SIGGRAPH 1987 course notes). The first and the last key only affect the tangents
at their neighbours; the motion does not pass through these two keys.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FEWEST = 4      # the smallest number of keys of a spline


class _Segments:
    """The times of a spline's segments. Segment k is between keys k + 1 and k + 2, for k from 0.

    Parameters
    ----------
    times : (n,) times of the keys. A key may be earlier than the key before it, as in a file of
        the BART scenes
    shape : (n, 3) tension, continuity and bias of the keys
    """

    def __init__(self, times: np.ndarray, shape: np.ndarray) -> None:
        before, self.first, self.last, after = (times[k:len(times) - 3 + k] for k in range(4))
        length = self.last - self.first
        (t1, c1, b1), (t2, c2, b2) = shape[1:-2].T, shape[2:-1].T
        # The paper's tangents, corrected for keys at unequal distances in time.
        leave = _over(length, self.last - before) * (1 - t1)
        arrive = _over(length, after - self.first) * (1 - t2)
        self._leave = leave * (1 + c1) * (1 + b1), leave * (1 - c1) * (1 - b1)
        self._arrive = arrive * (1 - c2) * (1 + b2), arrive * (1 + c2) * (1 - b2)

    def tangents(self, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the tangents at the first and at the last key of each segment, (n - 3, w) each.
        ``steps`` are the differences between keys, (n - 1, w)."""
        before, own, after = steps[:-2], steps[1:-1], steps[2:]
        return (self._leave[0][:, None] * before + self._leave[1][:, None] * own,
                self._arrive[0][:, None] * own + self._arrive[1][:, None] * after)

    def at(self, time: float) -> tuple[int, float]:
        """Return the segment of a time, and the time's position in the segment, from 0 to 1. For a
        time outside of all segments, return the nearest end."""
        if not self.first[0] < time:
            return 0, 0.0
        if not time < self.last[-1]:
            return len(self.last) - 1, 1.0
        k = int(np.argmax(time < self.last))
        return k, float((time - self.first[k]) / (self.last[k] - self.first[k]))


def _over(length: np.ndarray, span: np.ndarray) -> np.ndarray:
    """Return length / span, or 0 where span is 0. ``length`` is the duration of each segment;
    ``span`` also contains the segment before or after. If times ascend, a span of 0 implies a
    length of 0, and `_Segments.at` never returns such a segment."""
    return np.divide(length, span, out=np.zeros_like(length), where=span != 0)


class Spline:
    """Vectors along a spline: positions, or factors of a scale.

    Parameters
    ----------
    keys : (n, 7) float64 with n of at least 4: time, x, y, z, tension, continuity, bias
    """

    def __init__(self, keys: np.ndarray) -> None:
        self._segments = _Segments(keys[:, 0], keys[:, 4:7])
        place = keys[:, 1:4]
        step = np.diff(place, axis=0)
        leave, arrive = self._segments.tangents(step)
        own = step[1:-1]
        self._cubic = np.stack([place[1:-2], leave, 3 * own - 2 * leave - arrive,
                                leave + arrive - 2 * own])

    def at(self, time: float) -> np.ndarray:
        """Return the vector at a time, (3,) float64."""
        segment, u = self._segments.at(time)
        c = self._cubic[:, segment]
        return c[0] + u * (c[1] + u * (c[2] + u * c[3]))


class RotationSpline:
    """Rotations along a spline, by the shorter way between consecutive keys.

    Parameters
    ----------
    keys : (n, 8) float64 with n of at least 4: time, axis x, y, z, degrees, tension, continuity,
        bias
    """

    def __init__(self, keys: np.ndarray) -> None:
        self._segments = _Segments(keys[:, 0], keys[:, 5:8])
        turn = _quaternions(keys[:, 1:4], keys[:, 4])
        # q and -q are the same rotation. Choose the sign that brings q nearer to the key before.
        sign = np.where((turn[1:] * turn[:-1]).sum(axis=1) < 0, -1.0, 1.0)
        turn[1:] *= np.cumprod(sign)[:, None]
        step = _log(_product(turn[:-1] * (1, -1, -1, -1), turn[1:]))
        leave, arrive = self._segments.tangents(step)
        own, p, q = step[1:-1], turn[1:-2], turn[2:-1]
        self._ends, self._inner = (p, q), (_product(p, _exp((leave - own) / 2)),
                                           _product(q, _exp((own - arrive) / 2)))

    def at(self, time: float) -> np.ndarray:
        """Return the rotation at a time as a matrix, (3, 3) float64."""
        k, u = self._segments.at(time)
        (p, q), (a, b) = self._ends, self._inner
        return _matrix(_slerp(_slerp(p[k], q[k], u), _slerp(a[k], b[k], u), 2 * u * (1 - u)))


def _quaternions(axis: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Return (n, 4) unit quaternions, real part first; the identity for an axis of length 0."""
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    half = np.radians(degrees)[:, None] / 2 * (length > 0)
    return np.concatenate([np.cos(half), np.sin(half) * axis / np.where(length > 0, length, 1)],
                          axis=1)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    w, v = a[..., :1], a[..., 1:]
    return np.concatenate([
        w * b[..., :1] - (v * b[..., 1:]).sum(axis=-1, keepdims=True),
        w * b[..., 1:] + b[..., :1] * v + np.cross(v, b[..., 1:])], axis=-1)


def _log(q: np.ndarray) -> np.ndarray:
    """Return the logarithms of (n, 4) unit quaternions, (n, 3), without their zero real parts."""
    sine = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    angle = np.arctan2(sine, q[:, :1])
    return q[:, 1:] * np.divide(angle, sine, out=np.ones_like(sine), where=sine > 1e-12)


def _exp(v: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([np.cos(angle), v * np.sinc(angle / np.pi)], axis=1)


def _slerp(p: np.ndarray, q: np.ndarray, u: float) -> np.ndarray:
    """Return the unit quaternion at u on the arc from p to q; exactly p at u = 0, exactly q at
    u = 1."""
    angle = np.arctan2(np.linalg.norm(p - q), np.linalg.norm(p + q)) * 2
    if u in (0, 1) or np.sin(angle) < 1e-9:
        return q if u == 1 else p
    return (np.sin((1 - u) * angle) * p + np.sin(u * angle) * q) / np.sin(angle)


def _matrix(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q.tolist()
    return np.array([
        [1 - (2 * y * y + 2 * z * z), 2 * y * x - 2 * z * w, 2 * z * x + 2 * y * w],
        [2 * y * x + 2 * z * w, 1 - (2 * x * x + 2 * z * z), 2 * z * y - 2 * x * w],
        [2 * z * x - 2 * y * w, 2 * z * y + 2 * x * w, 1 - (2 * x * x + 2 * y * y)]])


@dataclass(frozen=True, eq=False)
class KeyedMotion:
    """The key frames of a transform. A part that is None changes nothing.

    Attributes
    ----------
    translation : positions of the transform's origin, in the coordinates of the parent transform
    rotation : rotations around this origin
    scale : factors along the three axes
    visibility : (n, 2) times and flags; a flag is valid until the next time, and 0 hides the
        transform's content
    """

    translation: Spline | None = None
    rotation: RotationSpline | None = None
    scale: Spline | None = None
    visibility: np.ndarray | None = None

    def at(self, time: float) -> np.ndarray:
        """Return the transform at a time, (3, 4) float64: first scale, then rotate, then move."""
        found = np.eye(3, 4)
        if self.rotation is not None:
            found[:, :3] = self.rotation.at(time)
        if self.scale is not None:
            found[:, :3] *= self.scale.at(time)
        if self.translation is not None:
            found[:, 3] = self.translation.at(time)
        return found

    def visible(self, time: float) -> bool:
        """Return whether the transform's content is visible at a time."""
        if self.visibility is None:
            return True
        begun = self.visibility[self.visibility[:, 0] <= time]
        return bool(begun[-1, 1]) if len(begun) else True
