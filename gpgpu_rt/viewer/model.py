"""The viewer's model: settings, camera, how fine to draw, and what was found. It has no window.

A window calls `step` again and again and shows ``image``; between two calls it changes the
selection, camera and mode. Each call does one piece of work at most and raises nothing: what a
user's mistake or a broken file leads to is said in ``message``, and what was shown before stays.
"""
from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from PIL import Image

from ..errors import Error
from ..gl.context import Gpu, open_gpu
from ..inspect import false_colours as colours
from ..scene.camera import Camera
from ..scene.loading import load_scene
from ..tracer import Tracer
from .drawn import Drawn
from .heat_view import HeatView
from .journey import Journey
from .line import line_of, settings_of
from .pace import PATIENCE, Pace
from .ray_path import RayPath, follow
from .saving import free_name, write
from .selection import Selection
from .tracers import Tracers

MODES = ("picture", "heat", "passes")
SETTLED = 0.1           # seconds without a move after which the camera rests
JOURNEY_RAYS = 160      # a side, at most
HISTORY = 120           # pictures


class Viewer:
    """What is looked at, and what is seen of it.

    Parameters
    ----------
    selection : what to begin with
    size : (width, height) pixels of the finest picture
    context : as for `Tracer`: a window's, say
    camera : where to look from, by default the scene's own

    Raises
    ------
    Error
        where the first scene or method cannot be had

    Attributes
    ----------
    image : (h, w, 3) uint8, what is to be shown, as coarse as there was time for; or None
    version : grows with every new image
    message : the last error or news, one line
    failed : why what is looked at cannot be drawn, or ""; it is not tried again
    """

    def __init__(self, selection: Selection = Selection(), size: tuple[int, int] = (640, 480),
                 context: str | moderngl.Context | Gpu | None = None,
                 camera: Camera | None = None,
                 clock: Callable[[], float] = time.perf_counter) -> None:
        self.gpu = open_gpu(context)
        self.clock, self.size = clock, size
        self.message = self.failed = ""
        self.version = 0
        self.image: np.ndarray | None = None
        self.divisor: int | None = None         # of what is shown; None: nothing of this pose yet
        self.mode = MODES[0]
        self.heat = HeatView()
        self.journey: Journey | None = None
        self.index, self.field = 0, "phase"     # of the journey: which pass, what of it
        self.path: RayPath | None = None
        self.history: deque[Drawn] = deque(maxlen=HISTORY)
        self.settled_after: float | None = None     # seconds from the last move to full quality
        self.pace = Pace(clock)
        self._wanted: Selection | None = None
        self._asked: tuple[int, ...] | None = None      # the pixel whose ray to follow
        self._announced = ""        # what was said in time to be about to happen
        self._insist = self._moved = self._opening = False
        self._moved_at = clock()
        self.selection = selection
        self.scene = load_scene(selection.scene)
        self.tracers = Tracers(self.gpu, self.scene)
        self._camera = self._home = camera or self.scene.camera
        self.tracer = self.tracers.pinned = self._make(self.tracers, selection)

    def _make(self, tracers: Tracers, selection: Selection) -> Tracer:
        return tracers.get(selection.method, selection.options, selection.integrator,
                           selection.light)

    # What a user changes --------------------------------------------------------------------

    @property
    def camera(self) -> Camera:
        return self._camera

    @camera.setter
    def camera(self, camera: Camera) -> None:
        """Look from elsewhere."""
        if camera == self._camera:
            return
        self._camera, self._moved_at, self._moved = camera, self.clock(), True
        self._outdated()

    def reset_camera(self) -> None:
        """Back to where it was at first."""
        self.camera = self._home

    def choose(self, selection: Selection) -> None:
        """Look at something else, from the next but one `step` on: the one before gives a window
        time to say what is going on."""
        if selection != self.selection:
            self._wanted, self.message = selection, ""

    def open(self, source: str | os.PathLike[str]) -> None:
        """Look at another scene: a name, or a file that was dropped."""
        self.choose(replace(self.selection, scene=os.fspath(source)))

    def resize(self, size: tuple[int, int]) -> None:
        """Draw pictures of (width, height) pixels; a window that is minimised has none."""
        if min(size) > 0 and size != self.size:
            self.size = size
            self._outdated()

    def look_at(self, mode: str) -> None:
        """Another mode of MODES."""
        if mode != self.mode:
            self.mode, self.message, self._opening = mode, "", True
            self.pace.forget()
            self._outdated()

    def change_heat(self, **changes: Any) -> None:
        """Other attributes of the heat view; a wipe needs no new measurement."""
        before = self.heat
        self.heat = replace(before, **changes)
        if replace(before, wipe=self.heat.wipe) != self.heat:
            self._outdated()
        elif self.mode == "heat" and self.heat.maps:
            self._show(self.heat.pixels())

    def go_to(self, index: int, field: str | None = None) -> None:
        """Show another pass of the journey, or another field."""
        if self.journey is None:
            return
        self.field = field or self.field
        if self.field not in self.journey.fields:
            self.field = "phase"
        self.index = int(np.clip(index, 0, len(self.journey.kept) - 1))
        if self.mode == "passes":
            self._show(self.journey.pixels(self.index, self.field))

    def insist(self) -> None:
        """Draw every pixel, however long it takes."""
        self._insist, self.failed = True, ""

    def follow(self, pixel: tuple[int, int]) -> None:
        """Trace the ray through a pixel of the finest picture alone, as the next but one `step`;
        its path is then there."""
        self._asked = tuple(pixel)

    # What is done about it ------------------------------------------------------------------

    @property
    def busy(self) -> str:
        """What the next steps are going to do, where it may take a while; else empty."""
        wanted = self._wanted
        if wanted is not None:
            return (f"loading {wanted.scene} ..." if wanted.scene != self.selection.scene
                    else f"building {wanted.method} ...")
        if self._asked is not None:
            return "following a ray ..."
        if self.mode == "passes" and self.journey is None and not self.failed:
            return "tracing pass by pass, once the camera rests ..."
        return ""

    @property
    def at_rest(self) -> bool:
        """Whether the camera has not moved for a moment."""
        return self.clock() - self._moved_at >= SETTLED

    @property
    def finished(self) -> bool:
        """Whether the next step would do nothing."""
        return (self._wanted is None and self._asked is None and self.at_rest
                and self._next_divisor() is None)

    def step(self) -> bool:
        """Do one piece of work; whether ``image`` is another one now."""
        before = self.version
        if self.busy != self._announced:
            self._announced = self.busy
            if self.busy:
                return False
        if self._wanted is not None:
            self._take(self._wanted)
            self._wanted = None
        if self._asked is not None:
            self._follow(self._asked)
            self._asked = None
        divisor = self._next_divisor()
        if divisor is not None:
            with self._guarded() as went_well:
                self._draw(divisor)
                went_well.append(True)
            if not went_well:       # the same would go wrong again
                self.failed, self._insist = self.message, False
                if self.mode == "passes" or self.mode == "heat" and self.divisor is None:
                    self.heat.maps = ()     # what is on the screen is of something else
                    self._show(np.full((*self.size[::-1], 3), colours.OVER, np.uint8))
        return self.version != before

    def _next_divisor(self) -> int | None:
        if self.failed:
            return None
        if self._insist:
            return 1
        if not self.at_rest:
            return self.pace.moving() if self.divisor is None else None
        if self.mode == "passes":
            return 1 if self.journey is None else None
        return self.pace.resting(self.divisor)

    @property
    def held_back(self) -> float | None:
        """Seconds that the next finer picture would take, where it is not drawn unless one
        insists."""
        if self.mode == "passes" or self.divisor in (None, 1) or not self.finished:
            return None
        estimate = self.pace.estimate(1)
        return estimate if estimate is not None and estimate > PATIENCE else None

    def _take(self, wanted: Selection) -> None:
        """Make what was chosen, prove it, and only then let go of what was there."""
        with self._guarded():
            if wanted.scene == self.selection.scene:
                self.tracer = self._make(self.tracers, wanted)
            else:
                scene = load_scene(wanted.scene)
                if not len(scene):
                    raise Error(f"{scene.name} holds no triangles; drop another file")
                tracers = Tracers(self.gpu, scene)
                try:
                    self.tracer = self._make(tracers, wanted)
                except BaseException:
                    tracers.release()
                    raise
                self.tracers.release()
                self.tracers, self.scene = tracers, scene
                self._camera = self._home = scene.camera
                self._moved_at = self.clock()
            self.tracers.pinned = self.tracer
            self.selection, self.path, self._opening = wanted, None, True
            self.pace.forget()
            self._outdated()

    def _draw(self, divisor: int) -> None:
        size = tuple(max(1, -(-side // divisor)) for side in self.size)
        journeying, made = self.mode == "passes" and self.at_rest, self.tracers.made
        counting = self.heat.tracers(self.tracers, self.selection.method, self.selection.options
                                     ) if self.mode == "heat" else []
        began = self.clock()
        if journeying:
            self._travel()
        elif self.mode == "heat":
            costs = self.heat.measure(counting, self.camera, size)
            pixels = self.heat.pixels()
        else:
            picture = self.tracer.render(self.camera, size, self.selection.integrator,
                                         **self.selection.light)
            pixels, costs = np.asarray(picture), [self.tracer.statistics]
        seconds = self.clock() - began
        if journeying:
            return
        rays = sum(one.rays if self.mode == "heat" else size[0] * size[1] * max(one.waves, 1)
                   for one in costs)
        self.history.append(Drawn(divisor, seconds, rays, sum(one.passes for one in costs),
                                  tuple(n for one in costs for n in one.live)))
        if self.tracers.made == made:   # else its first programs were compiled along with it
            self.pace.measured(divisor, seconds)
        self.divisor = divisor
        if divisor == 1:
            self._insist = False
            self.settled_after = self.clock() - self._moved_at if self._moved else None
            self._moved = False
        self._show(pixels)

    @property
    def journey_size(self) -> tuple[int, int]:
        """(width, height) rays whose passes are kept."""
        divisor = -(-max(self.size) // JOURNEY_RAYS)
        return max(1, self.size[0] // divisor), max(1, self.size[1] // divisor)

    def _travel(self) -> None:
        """Keep the states of all passes, of as many rays as can be kept."""
        tracer = self.tracers.in_passes(self.selection.method, self.selection.options)
        self.journey = Journey(tracer, self.camera, self.journey_size)
        self.message = self.journey.note
        self.divisor = 1
        # At first no ray has done anything yet: nothing would be seen.
        self.go_to(self.journey.halfway() if self._opening else self.index)
        self._opening = False

    def _follow(self, pixel: tuple[int, ...]) -> None:
        with self._guarded():
            x, y = (int(np.clip(p, 0, s - 1)) for p, s in zip(pixel, self.size))
            tracer = self.tracers.in_passes(self.selection.method, self.selection.options,
                                            single=True)
            self.path = follow(tracer, self.camera, self.size, (x, y))

    def _outdated(self) -> None:
        """What is shown is of another pose or choice."""
        self.divisor = self.journey = None
        self._insist, self.failed = False, ""

    def _show(self, pixels: np.ndarray) -> None:
        self.image = pixels
        self.version += 1

    @contextmanager
    def _guarded(self) -> Iterator[list[bool]]:
        """Say what goes wrong instead of ending the program: a window must outlive any file and
        any method, those that users bring included."""
        try:
            with self.gpu:
                yield []
        except Exception as failure:
            self.tell(failure)
            self.gpu.context.error      # what GL recorded belongs to what failed

    def tell(self, failure: Exception) -> None:
        """Say it in a line; with GPGPU_RT_TRACEBACK set, raise it after all."""
        if os.environ.get("GPGPU_RT_TRACEBACK"):
            raise failure
        text = " ".join(str(failure).split()) or "no more is known"
        known = isinstance(failure, (Error, ValueError, OSError))
        self.message = text if known else f"{type(failure).__name__}: {text}"

    # What is found --------------------------------------------------------------------------

    @property
    def command(self) -> str:
        """The line for a shell that makes what is shown; where none does, a comment that says so,
        and why."""
        line, note = line_of(self)
        return line or f"# {note}"

    @property
    def last(self) -> Drawn | None:
        """What the last picture took."""
        return self.history[-1] if self.history else None

    def ray_of(self, pixel: tuple[int, int]) -> list[tuple[str, str]]:
        """In passes: the state of the ray at a pixel of the finest picture, in words."""
        if self.journey is None:
            return []
        (width, height), (x, y) = self.journey.size, pixel
        column = int(np.clip(x * width // self.size[0], 0, width - 1))
        row = int(np.clip(y * height // self.size[1], 0, height - 1))
        return self.journey.state_of(self.index, row * width + column)

    def settings(self) -> dict[str, Any]:
        """All that what is shown follows from, and the line that makes it again, if one does."""
        return settings_of(self)

    def save(self, folder: str | os.PathLike[str] = ".") -> Path | None:
        """Write the picture with all its pixels, as a PNG that holds its settings, and these as
        JSON beside it; None where that failed, which ``message`` then says."""
        with self._guarded():
            path = free_name(Path(folder), f"{self.scene.name}-{self.selection.method}"
                             + (f"-{self.mode}" if self.mode != MODES[0] else ""))
            if self.mode == "passes":
                if self.journey is None:
                    self._travel()
            elif self.divisor != 1:
                self._draw(1)
            assert self.image is not None
            image = Image.fromarray(self.image)
            if self.mode == "heat":
                image = self.heat.with_scale(image)
            write(path, image, self.settings())
            self.message = f"wrote {path}"
            return path
        return None

    def release(self) -> None:
        """Free what the tracers hold."""
        self.tracers.release()
