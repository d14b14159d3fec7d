"""The viewer's model: settings, camera, resolution and results, without a window.

A window calls `step` repeatedly and shows ``image``. Between calls, it may change the selection,
the camera and the mode. Each call draws at most one picture. If a call fails, ``message`` has the
error, and the last picture stays.
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

from ..errors import Error
from ..gl.context import Gpu, open_gpu
from ..inspect import false_colours as colours
from ..scene.camera import Camera
from ..scene.loading import load_scene
from ..tracer import Tracer
from .drawn import Drawn
from .drawn_camera import fitted, rounded
from .failure import line_of_failure
from .heat_view import HeatView
from .journey import Journey
from .line import line_of, settings_of
from .pace import PATIENCE, Pace
from .ray_path import RayPath, follow
from .saving import name_for, picture_of, write
from .selection import Selection
from .tracers import Tracers

MODES = ("picture", "heat", "passes")
SETTLED = 0.1           # the camera is at rest after this many seconds without a move
JOURNEY_RAYS = 160      # limit on the rays along a side of the picture in the mode "passes"
HISTORY = 120           # number of pictures in the graphs


class Viewer:
    """The state of the viewer.

    Parameters
    ----------
    selection : the first selection
    size : (width, height) in pixels of the finest picture
    context : as for `Tracer`, for example the context of a window
    camera : the first camera; None for the scene's own
    clock : returns the time in seconds

    Raises
    ------
    Error
        if the first scene or method cannot be loaded

    Attributes
    ----------
    image : (h, w, 3) uint8, the picture to show, possibly at low resolution; or None
    version : increases with every new image
    message : the last error, or the last report such as "wrote a.png", in one line
    failed : the reason why `step` cannot draw the present selection, or ""
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
        self.divisor: int | None = None     # None: the shown picture is outdated
        self.mode = MODES[0]
        self.heat = HeatView()
        self.journey: Journey | None = None
        self.index, self.field = 0, "phase"     # the shown pass and field of the journey
        self.path: RayPath | None = None
        self.history: deque[Drawn] = deque(maxlen=HISTORY)
        self.settled_after: float | None = None     # seconds from the last move to full quality
        self.pace = Pace(clock)
        self._wanted: Selection | None = None
        self._asked: tuple[int, ...] | None = None      # the pixel whose ray to follow
        self._announced = ""        # the value of `busy` at the last step
        self._insist = self._moved = self._opening = False
        self._moved_at = clock()
        self.selection = selection
        self.scene = load_scene(selection.scene)
        self.tracers = Tracers(self.gpu, self.scene)
        self._camera = self._home = camera or self.scene.camera
        self._view: tuple[object, Camera] = None, self._camera
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
        if camera == self._camera:
            return
        self._camera, self._moved_at, self._moved = camera, self.clock(), True
        self._outdated()

    @property
    def view(self) -> Camera:
        """The camera that draws: ``camera``, fitted to the picture, with rounded numbers."""
        asked = self._camera, self.size, self.scene.camera
        if self._view[0] != asked:
            self._view = asked, rounded(fitted(self._camera, self.size), *asked[1:])
        return self._view[1]

    def reset_camera(self) -> None:
        self.camera = self._home

    def choose(self, selection: Selection) -> None:
        """Request another selection. The next call of `step` returns at once, so that a window can
        show ``busy``. The call after that changes the selection."""
        if selection != self.selection:
            self._wanted, self.message = selection, ""

    def open(self, source: str | os.PathLike[str]) -> None:
        self.choose(replace(self.selection, scene=os.fspath(source)))

    def resize(self, size: tuple[int, int]) -> None:
        """Change the size of pictures in pixels, but ignore a minimised window. Pictures are
        coarse until the size has stayed the same for SETTLED seconds."""
        if min(size) > 0 and size != self.size:
            self.size, self._moved_at = size, self.clock()
            self._outdated()

    def look_at(self, mode: str) -> None:
        if mode != self.mode:
            self.mode, self.message, self._opening = mode, "", True
            self.pace.forget()
            self._outdated()

    def change_heat(self, **changes: Any) -> None:
        """Change attributes of the heat view. A new ``wipe`` alone needs no new measurement."""
        before = self.heat
        self.heat = replace(before, **changes)
        if replace(before, wipe=self.heat.wipe) != self.heat:
            self._outdated()
        elif self.mode == "heat" and self.heat.maps:
            self._show(self.heat.pixels())

    def go_to(self, index: int, field: str | None = None) -> None:
        """Show a pass of the journey (the recorded passes) by index, and a field of the rays."""
        if self.journey is None:
            return
        self.field = field or self.field
        if self.field not in self.journey.fields:
            self.field = "phase"
        self.index = int(np.clip(index, 0, len(self.journey.kept) - 1))
        if self.mode == "passes":
            self._show(self.journey.pixels(self.index, self.field))

    def insist(self) -> None:
        """Draw every pixel, even if that takes long."""
        self._insist, self.failed = True, ""

    def follow(self, pixel: tuple[int, int]) -> None:
        """Request the path of a pixel's ray. As after `choose`, the second call of `step` does the
        work: it stores ``path``."""
        self._asked = tuple(pixel)

    # Work ----------------------------------------------------------------------------------

    @property
    def busy(self) -> str:
        """A line about the work of the next steps; "" for short work."""
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
        return self.clock() - self._moved_at >= SETTLED

    @property
    def finished(self) -> bool:
        return (self._wanted is None and self._asked is None and self.at_rest
                and self._next_divisor() is None)

    def step(self) -> bool:
        """Do the requested work, then draw a picture. Return whether ``image`` has changed."""
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
            if not went_well:       # a second attempt would fail in the same way
                self.failed, self._insist = self.message, False
                if self.mode == "passes" or self.mode == "heat" and self.divisor is None:
                    self.heat.maps = ()     # the picture on the screen is out of date
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
        """The estimated seconds of a picture of every pixel, if only `insist` draws this picture;
        otherwise None."""
        if self.mode == "passes" or self.divisor in (None, 1) or not self.finished:
            return None
        estimate = self.pace.estimate(1)
        return estimate if estimate is not None and estimate > PATIENCE else None

    def _take(self, wanted: Selection) -> None:
        """Make and test the tracer of a selection before the old tracer is dropped."""
        with self._guarded():
            if wanted.scene == self.selection.scene:
                self.tracer = self._make(self.tracers, wanted)
            else:
                scene = load_scene(wanted.scene)
                if not len(scene):
                    raise Error(f"{scene.name} has no triangles; choose another file")
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
            costs = self.heat.measure(counting, self.view, size)
            pixels = self.heat.pixels()
        else:
            picture = self.tracer.render(self.view, size, self.selection.integrator,
                                         **self.selection.light)
            pixels, costs = np.asarray(picture), [self.tracer.statistics]
        seconds = self.clock() - began
        if journeying:
            return
        rays = sum(one.rays if self.mode == "heat" else size[0] * size[1] * max(one.waves, 1)
                   for one in costs)
        self.history.append(Drawn(divisor, seconds, rays, sum(one.passes for one in costs),
                                  tuple(n for one in costs for n in one.live)))
        if self.tracers.made == made:   # a new tracer's time would include compilation
            self.pace.measured(divisor, seconds)
        self.divisor = divisor
        if divisor == 1:
            self._insist = False
            self.settled_after = self.clock() - self._moved_at if self._moved else None
            self._moved = False
        self._show(pixels)

    @property
    def journey_size(self) -> tuple[int, int]:
        divisor = -(-max(self.size) // JOURNEY_RAYS)
        return max(1, self.size[0] // divisor), max(1, self.size[1] // divisor)

    def _travel(self) -> None:
        tracer = self.tracers.in_passes(self.selection.method, self.selection.options)
        self.journey = Journey(tracer, self.view, self.journey_size)
        self.message = self.journey.note
        self.divisor = 1
        # Open in the middle, because the first pass shows nothing yet.
        self.go_to(self.journey.halfway() if self._opening else self.index)
        self._opening = False

    def _follow(self, pixel: tuple[int, ...]) -> None:
        with self._guarded():
            x, y = (int(np.clip(p, 0, s - 1)) for p, s in zip(pixel, self.size))
            tracer = self.tracers.in_passes(self.selection.method, self.selection.options,
                                            single=True)
            self.path = follow(tracer, self.view, self.size, (x, y))

    def _outdated(self) -> None:
        self.divisor = self.journey = None
        self._insist, self.failed = False, ""

    def _show(self, pixels: np.ndarray) -> None:
        self.image = pixels
        self.version += 1

    @contextmanager
    def _guarded(self) -> Iterator[list[bool]]:
        """Report an error in ``message`` instead of ending the program."""
        try:
            with self.gpu:
                yield []
        except Exception as failure:
            self.tell(failure)
            self.gpu.context.error      # clear the error that OpenGL recorded

    def tell(self, failure: Exception) -> None:
        """Report an error in ``message``. If GPGPU_RT_TRACEBACK is set, raise the error."""
        if os.environ.get("GPGPU_RT_TRACEBACK"):
            raise failure
        self.message = line_of_failure(failure)

    # Results --------------------------------------------------------------------------------

    @property
    def command(self) -> str:
        """The shell command that makes the shown picture, or a comment with the reason why there
        is no command."""
        line, note = line_of(self)
        return line or f"# {note}"

    @property
    def last(self) -> Drawn | None:
        return self.history[-1] if self.history else None

    def ray_of(self, pixel: tuple[int, int]) -> list[tuple[str, str]]:
        """Return the state of a pixel's ray, as (field, text); empty outside the mode "passes"."""
        if self.journey is None:
            return []
        return self.journey.state_of(self.index, self.journey.ray_at(pixel, self.size))

    def settings(self) -> dict[str, Any]:
        return settings_of(self)

    def save(self, folder: str | os.PathLike[str] = ".") -> Path | None:
        """Draw every pixel. Write a PNG, and the settings as JSON beside it. Return the PNG's
        path. After an error, return None and set ``message``."""
        with self._guarded():
            path = name_for(self, Path(folder))     # fails early if the folder is not writable
            if self.mode == "passes":
                if self.journey is None:
                    self._travel()
            elif self.divisor != 1:
                self._draw(1)
            write(path, picture_of(self), self.settings())
            self.message = f"wrote {path}"
            return path
        return None

    def release(self) -> None:
        self.tracers.release()
