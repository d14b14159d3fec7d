"""Tests that are skipped on ANGLE over SwiftShader, by the programs that they need."""
from __future__ import annotations

import math
import re
from collections.abc import Callable

import pytest

from gpgpu_rt.gl import shader

MOST_RAYS = 7      # most rays of a packet whose program under `loop` compiles in seconds
_SIDE = re.compile(r"^#define PACKET_(?:WIDTH|HEIGHT) (\d+)", re.M)


def _large_packet(fragment: str) -> bool:
    """Return whether a program traces packets of many rays in a single pass."""
    rays = math.prod(map(int, _SIDE.findall(fragment)))
    return rays > MOST_RAYS and "step_packet()" in fragment and "packet_target[" in fragment


# (whether a fragment program is meant, why no test compiles it)
EXCEPTIONS: tuple[tuple[Callable[[str], bool], str], ...] = (
    (_large_packet, "SwiftShader compiles the program of a packet of 8 or more rays under `loop` "
                    "for minutes"),
)


def skip_exceptions() -> None:
    """From now on, skip a test when it compiles a program in ``EXCEPTIONS`` on ANGLE."""
    texts = shader.angle_texts

    def checked(vertex: str, fragment: str) -> tuple[str, str]:
        for is_meant, reason in EXCEPTIONS:
            if is_meant(fragment):
                pytest.skip(reason)
        return texts(vertex, fragment)

    shader.angle_texts = checked
