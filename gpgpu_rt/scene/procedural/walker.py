"""Walker: an animal with joints that walks in a circle on a meadow."""
from __future__ import annotations

from functools import cache

import numpy as np

from ..camera import Camera
from .built import Built
from .shapes import ball, bump, floor, noise

STEP_SECONDS = 1.1     # the period of a leg's motion
SWING = 0.32           # radians; largest angle of a leg forwards and backwards
BEND = 0.7             # radians; largest bend of a knee while its foot is in the air
HIP = 1.45             # height of the hips in world units; the animal is about four units long
RADIUS = 3.2           # radius of the circle on which the animal walks, world units
# (x, z) of each leg's hip -> the leg's phase as a share of a step. The legs move in this order:
# hind leg and front leg of one side, then hind leg and front leg of the other side.
GAIT = {(1.1, -0.4): 0.0, (-1.1, -0.4): 0.25, (1.1, 0.4): 0.5, (-1.1, 0.4): 0.75}
# Indices of bones. From index LEGS on, each leg has two bones: a thigh and a shin.
TORSO, HEAD, TAIL, LEGS = 0, 1, 2, 3

HIDE, SPOTS, GRASS = (0.70, 0.66, 0.60), (0.34, 0.22, 0.15), (0.33, 0.48, 0.22)


def walker() -> Built:
    """Return the animal, 25,820 triangles, and the meadow at time 0: 28,412 triangles together."""
    animal = _rest()[0]
    middle = animal.mean(axis=1)
    spotted = (noise(middle, 0.9, 5) > 0.35)[:, None]
    meadow = _meadow()
    shade = 1 + 0.15 * noise(meadow.mean(axis=1), 0.8, 6)[:, None]
    colours = np.concatenate([np.where(spotted, SPOTS, HIDE), shade * GRASS])
    camera = Camera((-5.4, 5.0, 8.6), (-0.38, 0.8, -0.04), fov=50)
    return Built(walker_at(0.0), colours, camera, (-5.0, 9.0, 6.0))


def walker_at(seconds: float) -> np.ndarray:
    """Return (n, 3, 3) float32: the animal's triangles at time ``seconds``, then the meadow's."""
    triangles, bone = _rest()
    turns, moves = _pose(seconds / STEP_SECONDS)
    posed = np.einsum("kij,kvj->kvi", turns[bone], triangles) + moves[bone, None]
    # In half a step, a foot on the ground moves backwards by 2 * SWING * HIP relative to the body.
    # The animal moves forwards at the same mean speed, so that the foot hardly slides.
    speed = 4 * SWING * HIP / STEP_SECONDS
    round_about = _turn_about(1, -speed * seconds / RADIUS)
    posed = (posed + (0, 0, RADIUS)) @ round_about.T
    return np.concatenate([posed, _meadow()]).astype(np.float32)


def _pose(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return each bone's rotation, (3, 3), and its translation after the rotation, (3,). ``step``
    is the time in steps."""
    joints, parents, angles = [(0.0, 0.0, 0.0)], [-1], [0.0]

    def bone(joint: tuple[float, float, float], parent: int, angle: float) -> int:
        joints.append(joint)
        parents.append(parent)
        angles.append(angle)
        return len(joints) - 1
    sway = np.sin(2 * np.pi * step)
    bone((-1.3, 2.0, 0.0), TORSO, 0.07 * np.sin(4 * np.pi * step))
    bone((1.55, 1.95, 0.0), TORSO, 0.25 + 0.2 * sway)
    for (x, z), late in GAIT.items():
        phase = 2 * np.pi * (step - late)
        thigh = bone((x, HIP, z), TORSO, SWING * np.sin(phase))
        bone((x, 0.8, z), thigh, BEND * max(0.0, -np.cos(phase)))
    turns, moves = [np.eye(3)], [np.array([0.0, 0.03 * np.cos(4 * np.pi * step) - 0.05, 0.0])]
    for joint, parent, angle in zip(joints[1:], parents[1:], angles[1:]):
        turn = turns[parent] @ _turn_about(2, angle)
        moves.append(turns[parent] @ joint + moves[parent] - turn @ joint)
        turns.append(turn)
    return np.array(turns), np.array(moves)


def _turn_about(axis: int, angle: float) -> np.ndarray:
    """Return the (3, 3) rotation around a coordinate axis by an angle in radians."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
    return turn


@cache
def _rest() -> tuple[np.ndarray, np.ndarray]:
    """Return (k, 3, 3), the triangles of the animal on straight legs, head towards -x; and (k,)
    the bone of each triangle."""
    parts = [(TORSO, ball(9000, (0, 1.75, 0), (1.6, 0.72, 0.66))),
             (HEAD, ball(3000, (-1.6, 2.25, 0), (0.55, 0.35, 0.33), (0.0, -0.9))),
             (HEAD, ball(3000, (-2.05, 2.5, 0), (0.5, 0.27, 0.26), (0.0, 0.5))),
             (TAIL, ball(900, (1.65, 1.5, 0), (0.06, 0.6, 0.06)))]
    parts += [(HEAD, ball(500, (-1.85, 2.9, side * 0.25), (0.06, 0.2, 0.06), (side * 0.5, 0.0)))
              for side in (-1, 1)]
    for leg, (x, z) in enumerate(GAIT):
        thigh = LEGS + 2 * leg
        parts += [(thigh, ball(1000, (x, 1.15, z), (0.25, 0.52, 0.21))),
                  (thigh + 1, ball(1000, (x, 0.46, z), (0.13, 0.46, 0.13))),
                  (thigh + 1, ball(300, (x - 0.04, 0.09, z), (0.2, 0.09, 0.16)))]
    triangles = np.concatenate([part for _, part in parts])
    bone = np.repeat([number for number, _ in parts], [len(part) for _, part in parts])
    return bump(triangles, 0.02, 0.5), bone


@cache
def _meadow() -> np.ndarray:
    """Return (m, 3, 3), the triangles of uneven ground."""
    ground = floor((-6.0, -6.0), (6.0, 6.0), 0.0, 36)
    ground[..., 1] += 0.05 * (noise(ground, 2.5, 8) - 1)
    return ground
