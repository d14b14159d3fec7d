"""Splines agree with values derived by hand from the paper (gpgpu_rt/scene/aff/keyframes.py names
it), and are continuous at their keys."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.scene.aff.keyframes import KeyedMotion, RotationSpline, Spline
from gpgpu_rt.scene.aff.statements import rotation

PLACES = np.array([[0, 0, 0], [1, 2, 0], [3, 1, 1], [2, -1, 4], [5, 0, 0], [6, 1, 1]], float)


def spline(tcb=(0, 0, 0), times=range(6)) -> Spline:
    return Spline(np.column_stack([list(times), PLACES, np.tile(tcb, (6, 1))]))


def turns(degrees, axis=(0, 0, 1)) -> RotationSpline:
    count = len(degrees)
    axes = np.broadcast_to(axis, (count, 3))
    return RotationSpline(np.column_stack([range(count), axes, degrees, np.zeros((count, 3))]
                                          ).astype(float))


def test_zeros_give_a_catmull_rom_spline() -> None:
    p0, p1, p2, p3 = PLACES[1:5]
    for u in (0, 0.25, 0.5, 1):
        blend = 0.5 * np.array([-u + 2 * u**2 - u**3, 2 - 5 * u**2 + 3 * u**3,
                                u + 4 * u**2 - 3 * u**3, -u**2 + u**3])
        np.testing.assert_allclose(spline().at(2 + u), blend @ [p0, p1, p2, p3], atol=1e-14)


@pytest.mark.parametrize("tcb, leave, arrive", [
    ((1, 0, 0), (0, 0), (0, 0)),            # tension 1: no tangents
    ((-1, 0, 0), (1, 1), (1, 1)),           # tension -1: tangents of twice the length
    ((0, -1, 0), (0, 1), (1, 0)),           # continuity -1: straight lines with corners
    ((0, 1, 0), (1, 0), (0, 1)),            # continuity 1: tangents of continuity -1, swapped
    ((0, 0, 1), (1, 0), (1, 0)),            # bias 1: tangents of the step before
    ((0, 0, -1), (0, 1), (0, 1)),           # bias -1: tangents of the step after
    ((0.5, 0.25, -0.5), (0.15625, 0.28125), (0.09375, 0.46875))])
def test_tension_continuity_and_bias(tcb, leave, arrive) -> None:
    """Two tangents decide the curve from key 2 to key 3. The curve leaves key 2 along the first
    tangent and arrives at key 3 along the second tangent.

    Each tangent is a weighted sum of the step before its key and the step after its key. The
    weights are ``leave`` for key 2 and ``arrive`` for key 3.
    """
    steps = np.diff(PLACES, axis=0)
    out, into = leave @ steps[1:3], arrive @ steps[2:4]
    for u in (0.2, 0.5, 0.9):
        hermite = ((2 * u**3 - 3 * u**2 + 1) * PLACES[2] + (u**3 - 2 * u**2 + u) * out
                   + (3 * u**2 - 2 * u**3) * PLACES[3] + (u**3 - u**2) * into)
        np.testing.assert_allclose(spline(tcb).at(2 + u), hermite, atol=1e-14)


def test_unequal_times_keep_the_velocity() -> None:
    times = np.array([0, 1, 1.5, 4, 4.25, 9])
    moving = spline(times=times)
    for time in times[2:-2]:
        before, after = ((moving.at(time + way * 1e-6) - moving.at(time)) / (way * 1e-6)
                         for way in (-1, 1))
        np.testing.assert_allclose(before, after, atol=1e-3)
        assert np.abs(after).max() > 0.5
    for time, place in zip(times[1:-1], PLACES[1:-1]):
        np.testing.assert_allclose(moving.at(time), place, atol=1e-14)


def test_times_outside_give_the_ends() -> None:
    assert (spline().at(-5) == PLACES[1]).all() and (spline().at(1) == PLACES[1]).all()
    np.testing.assert_allclose(spline().at(99), PLACES[4], atol=1e-14)


def test_equal_and_falling_times() -> None:
    """Splines accept keys at equal times and times that go back. BART's files contain both."""
    doubled = spline(times=[0, 0, 0, 1, 1, 1])
    assert (doubled.at(0) == PLACES[1]).all() and np.isfinite(doubled.at(0.5)).all()
    falling = spline(times=[0, 1, 4, 3, 5, 6])
    np.testing.assert_allclose(falling.at(4 - 1e-9), PLACES[2], atol=1e-6)
    np.testing.assert_allclose(falling.at(5), PLACES[4], atol=1e-14)
    assert all(np.isfinite(falling.at(time)).all() for time in np.linspace(0, 6, 50))


def test_equal_steps_turn_evenly() -> None:
    even = turns([-30, 0, 30, 60, 90, 120])
    for time in (1, 1.25, 2.5, 3.75):
        np.testing.assert_allclose(even.at(time), rotation(np.array([0, 0, 1.0]), 30 * time - 30),
                                   atol=1e-14)


def test_the_smaller_angle() -> None:
    """Between two keys, a rotation turns in the direction of the smaller angle."""
    np.testing.assert_allclose(turns([0, 0, 300, 300]).at(1.5),
                               rotation(np.array([0, 0, 1.0]), -30), atol=1e-14)
    whole = turns([0, 90, 180, 270, 360, 450, 540])     # a wheel keeps turning past 360 degrees
    np.testing.assert_allclose(whole.at(3.5), rotation(np.array([0, 0, 1.0]), 315), atol=1e-14)


def test_axes_need_no_length() -> None:
    """A rotation does not depend on its axis's length, but length 0 means no rotation."""
    np.testing.assert_allclose(turns([0, 0, 40, 40], axis=(0, 3, 4)).at(2),
                               turns([0, 0, 40, 40], axis=(0, 0.6, 0.8)).at(2), atol=1e-15)
    assert (turns([0, 90, 90, 0], axis=(0, 0, 0)).at(1) == np.eye(3)).all()
    assert (rotation(np.zeros(3), 90) == np.eye(3)).all()


def test_rotations_are_continuous_and_rigid() -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(0.2 + rng.random(9))
    keys = np.column_stack([times, rng.normal(size=(9, 3)), rng.uniform(-200, 200, 9),
                            np.zeros((9, 3))])
    moving = RotationSpline(keys)
    for time in np.linspace(times[0], times[-1], 60):
        matrix = moving.at(time)
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    for k in range(1, 8):
        np.testing.assert_allclose(moving.at(times[k]), rotation(keys[k, 1:4], keys[k, 4]),
                                   atol=1e-12)
    for time in times[2:-2]:
        before, after = ((moving.at(time + way * 1e-6) - moving.at(time)) / (way * 1e-6)
                         for way in (-1, 1))
        np.testing.assert_allclose(before, after, atol=1e-3)
        assert np.abs(after).max() > 0.1


def test_a_motion_scales_then_turns_then_moves() -> None:
    keys = np.column_stack([range(4), np.tile((2, 1, 1), (4, 1)), np.zeros((4, 3))])
    places = np.column_stack([range(4), np.tile((0, 0, 7), (4, 1)), np.zeros((4, 3))])
    motion = KeyedMotion(Spline(places), turns([90, 90, 90, 90]), Spline(keys))
    np.testing.assert_allclose(motion.at(1.5) @ (1, 0, 0, 1), (0, 2, 7), atol=1e-14)
    assert (KeyedMotion().at(1) == np.eye(3, 4)).all()


def test_visibility() -> None:
    """The latest visibility key decides whether a part is visible. Before its first key, a part is
    visible."""
    motion = KeyedMotion(visibility=np.array([(0.5, 0), (2, 1), (3, 0)], float))
    assert [motion.visible(time) for time in (-1, 0.4, 0.5, 1.9, 2, 3, 9)] == [
        True, True, False, False, True, False, False]
