"""A journey: the states of a picture's rays after each pass, for the viewer."""
from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..errors import Error
from ..gl.record import EXACT_INTEGER
from ..inspect import false_colours as colours
from ..inspect.pass_pictures import PLACES, distance_pixels, phase_pixels
from ..inspect.time_travel import Pass, decode, phase_names, travel
from ..rays.batch import RayBatch
from ..scene.camera import Camera
from ..text_format import counted
from ..tracer import Tracer

MOST_BYTES = 256 << 20      # if the stored states need more, drop every second pass
MOST_SECONDS = 20.0
# A t above this number is no point on a ray. For example, a ray that waits for its packet's next
# walk has t_min 3e38 (drivers/packet_turns.glsl).
NO_PLACE = 1e30


class _Enough(Exception):
    """Ends a journey that takes too long."""


class Journey:
    """All passes over the eye rays of a small picture.

    Parameters
    ----------
    tracer : a tracer under the schedule ``step`` or ``kernels``
    camera : the camera of the eye rays
    size : (width, height) in rays
    clock : returns the time in seconds
    seconds : time after which the journey stops
    most_bytes : limit on the size of all states

    Attributes
    ----------
    kept : the stored passes: all, or every second, fourth, ...
    live : (k,) number of live rays after each pass
    note : the reason why the journey is incomplete, or ""
    """

    def __init__(self, tracer: Tracer, camera: Camera, size: tuple[int, int],
                 clock: Callable[[], float] = time.perf_counter,
                 seconds: float = MOST_SECONDS, most_bytes: int = MOST_BYTES) -> None:
        self.size, self.every, self.note = size, 1, ""
        self.names = phase_names(tracer)
        self.kept: list[Pass] = []
        self._live: list[int] = []
        self._most, self._bytes = most_bytes, 0
        origins, directions = camera.rays(size)
        self._batch = RayBatch(origins, directions, bounds=tracer.scene.bounds)
        began = clock()

        def look(one: Pass) -> None:
            self._live.append(one.live)
            self._keep(one)
            if clock() - began > seconds:
                raise _Enough
        try:
            travel(tracer, origins, directions, look)
        except _Enough:
            self.note = f"stopped after {counted(len(self._live), 'pass')}, {seconds:g} s"
        if not self.kept:
            raise Error("the tracer ran no pass; choose the schedule step or kernels")
        self._scale()

    def _keep(self, one: Pass) -> None:
        if one.number % self.every:
            return
        self.kept.append(one)
        self._bytes += sum(v.nbytes for v in (*one.state.values(), *one.hit.values()))
        if self._bytes > self._most:
            self.kept, self.every, self._bytes = self.kept[::2], 2 * self.every, self._bytes // 2

    def _scale(self) -> None:
        hits = decode(self._batch, self.kept[-1])
        t = hits.t[hits.hit]
        self._lo, self._hi = (float(t.min()), float(t.max())) if len(t) else (0.0, 1.0)

    @property
    def live(self) -> np.ndarray:
        return np.array(self._live)

    @property
    def fields(self) -> tuple[str, ...]:
        last = self.kept[-1]
        return (*last.state, *(f"hit {name}" for name in last.hit))

    def halfway(self) -> int:
        """Return the index of the kept pass after which about half of the rays are live."""
        live = np.array([one.live for one in self.kept])
        return int(np.abs(2 * live - live.max()).argmin())

    def values(self, index: int, field: str) -> np.ndarray:
        """Return a field after the pass ``kept[index]``, (n,) or (n, 3)."""
        one = self.kept[index]
        return one.hit[field[4:]] if field.startswith("hit ") else one.state[field]

    def pixels(self, index: int, field: str) -> np.ndarray:
        """Return the picture of a field after the pass ``kept[index]``, (h, w, 3) uint8."""
        one = self.kept[index]
        if field == "hit t":
            shown = distance_pixels(decode(self._batch, one), self._lo, self._hi)
        elif field == "phase":
            shown = phase_pixels(one.state["phase"], self.names)
        elif field in PLACES or field == "hit triangle":
            shown = colours.scrambled(self.values(index, field))
            if field in PLACES:
                shown[one.state["phase"] <= 0] = colours.OVER
        else:
            shown = self._numbers(self.values(index, field))
        return shown.reshape(self.size[1], self.size[0], 3)

    @staticmethod
    def _numbers(values: np.ndarray) -> np.ndarray:
        """Colour values by a ramp from the smallest to the largest finite value. A vector counts
        as the sum of its components."""
        values = values.astype(np.float64).reshape(len(values), -1).sum(axis=1)
        finite = np.isfinite(values) & (np.abs(values) < NO_PLACE)
        shown = np.full((len(values), 3), colours.NOTHING, np.uint8)
        if finite.any():
            lo, hi = values[finite].min(), values[finite].max()
            shown[finite] = colours.ramp((values[finite] - lo) / max(hi - lo, 1e-30))
        return shown

    def caption(self, index: int) -> str:
        """Return a line about a pass: its kernel, the rays that each kernel advanced, and the live
        rays."""
        one = self.kept[index]
        served = ", ".join(f"{count:,} {name}" for name, count in one.served.items()) or "none"
        kernel = "chosen by each ray" if one.kernel == "all" else one.kernel
        return (f"pass {one.number:,} of {len(self._live) - 1:,}, kernel {kernel}; rays advanced: "
                f"{served}; live rays: {one.live:,} of {self.size[0] * self.size[1]:,}")

    def ray_at(self, pixel: tuple[int, int], size: tuple[int, int]) -> int:
        """Return the index of the ray at a pixel of a picture of ``size``."""
        column, row = (int(np.clip(at * mine // of, 0, mine - 1))
                       for at, mine, of in zip(pixel, self.size, size))
        return row * self.size[0] + column

    def state_of(self, index: int, ray: int) -> list[tuple[str, str]]:
        """Return every field of a ray after the pass ``kept[index]``, as (name, text)."""
        one = self.kept[index]
        found = {field: word_of(values[ray]) for field, values in one.state.items()}
        found["phase"] += f" ({self.names.get(int(one.state['phase'][ray]), '?')})"
        return [*found.items(),
                *((f"hit {name}", text) for name, text in hit_words(one, ray).items())]


def hit_words(one: Pass, ray: int) -> dict[str, str]:
    """Return the fields of a ray's nearest hit so far as text; "-" before the first hit."""
    none = not np.isfinite(one.hit["t"][ray])
    return {name: "-" if none else word_of(values[ray]) for name, values in one.hit.items()}


def word_of(value: np.ndarray | np.generic) -> str:
    """Return the text of a field's value, exact enough to identify a float32; "-" for no node, and
    for a t above NO_PLACE."""
    if np.ndim(value):
        return " ".join(word_of(part) for part in value)
    if value == EXACT_INTEGER or value > NO_PLACE:
        return "-"
    return str(int(value)) if np.issubdtype(value.dtype, np.integer) else f"{float(value):.9g}"
