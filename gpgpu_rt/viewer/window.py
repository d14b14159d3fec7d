"""The viewer's window: forwards events to the model, and draws the picture and the panels."""
from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable
from statistics import median
from typing import Any

import glfw
import moderngl_window
import numpy as np
from imgui_bundle import imgui

from ..errors import ContextError, Error
from ..methods import methods
from ..scene.camera import Camera
from ..scene.loading import load_scene
from . import moves
from .link import Link
from .model import MODES, Viewer
from .panels import Panels
from .path_drawing import draw_path
from .press import Press
from .selection import Selection

TURN = 0.008            # radians per pixel of dragging
FLY = 0.35              # speed of flight in extents of the scene per second
CLICK = 4               # largest movement of the mouse in pixels during a click
QUIET = 0.5             # seconds without an event after which the window draws less often
PAUSE = 0.04            # seconds of sleep between two frames while the window draws less often


def run(selection: Selection, size: tuple[int, int], folder: str = ".",
        place: Callable[[Camera], Camera] = lambda own: own) -> dict[str, Any]:
    """Open the window and return when it is closed.

    Parameters
    ----------
    selection : the first selection
    size : (width, height) of the window in pixels
    folder : the folder for saved pictures
    place : returns the first camera, given the scene's own camera

    Returns
    -------
    measurements that were made while the window was open
    """
    load_scene(selection.scene)       # report a wrong scene before the window opens

    class Configured(Window):
        window_size = size
        given = selection, folder, place

    logging.getLogger("moderngl_window").setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")     # glfw raises an exception after each warning
            config = moderngl_window.create_window_config_instance(
                Configured, args=["--window=glfw", "--vsync=true"])
    except Error:
        raise
    except Exception as failure:    # each window library has its own exceptions
        raise ContextError(f"cannot open a window ({type(failure).__name__}: {failure}); set "
                           "DISPLAY to a screen, or use `gpgpu-rt render`") from failure
    assert isinstance(config, Window)
    _stay(config)
    return config.measured()


def _stay(config: Window) -> None:
    """Run moderngl_window's loop until the window is closed. Show errors of event handlers and of
    the window library as messages."""
    window = config.wnd
    config.timer.start()
    while not window.is_closing:
        now, passed = config.timer.next_frame()
        window.use()
        try:
            window.render(now, passed)
            if not window.is_closing:
                window.swap_buffers()
        except Exception as failure:
            config.viewer.tell(failure)
            config.link.abandon()
        if not window.visible:
            time.sleep(PAUSE)
    config.viewer.release()
    window.destroy()


class Window(moderngl_window.WindowConfig):
    """The window, with the methods that moderngl_window calls."""

    title = "gpgpu-rt"
    gl_version = (3, 3)
    aspect_ratio = None
    resizable = True
    clear_color = None
    log_level = logging.ERROR
    given: tuple[Selection, str, Callable[[Camera], Camera]]

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        selection, self.folder, place = self.given
        self.wnd.exit_key = None        # Escape closes lists and messages, not the program
        self.viewer = Viewer(selection, self.wnd.buffer_size, self.ctx)
        self.viewer.camera = place(self.viewer.camera)
        self.link = Link(self.viewer.gpu, self.wnd)
        self.panels = Panels(self.viewer, self.link, self._save)
        self.panels.help = True
        self._fit()
        self.flying = False
        self._held: set[int] = set()        # the flight keys that are down
        self._mouse = (0, 0)
        self._press: Press | None = None
        # moderngl_window reports dropped files only with pyglet, and pyglet loses them on X11. So
        # handle dropped files here.
        glfw.set_drop_callback(self.wnd._window, self._dropped)
        self._last_event = time.perf_counter()
        self._shown = -1            # version of the uploaded picture
        self._picture: Any = None
        self._updates: list[float] = []     # seconds between pictures while the camera moves
        self._settled: list[float] = []
        self._last_update = 0.0
        self._frames, self._title = 0, ""

    # Drawing --------------------------------------------------------------------------------

    def on_render(self, time: float, frame_time: float) -> None:    # noqa: A002
        self._frames += 1
        self._fit()
        changed = self.viewer.step()
        self.panels.program.update(self.viewer)
        self._measure(changed)
        if min(self.wnd.buffer_size) < 1:
            return
        self.wnd.use()
        self.ctx.clear(0.06, 0.06, 0.08)
        self.link.gpu.fences.keep()
        self.link.begin(frame_time)
        self._follow_mouse()
        self._follow_keys()
        self._fly(min(frame_time, 0.2))
        self._draw_picture()
        if self.viewer.path is not None:
            draw_path(self.viewer.path, self.viewer.view, self.panels.layout.picture)
        self.panels.draw(self._pixel(*self._mouse))
        self.link.end()
        self._entitle()
        self._rest()

    def _fit(self) -> None:
        """Make the picture as large as the free part of the window."""
        ratio = self.wnd.pixel_ratio
        width, height = self.panels.layout.picture.size
        self.viewer.resize((round(ratio * width), round(ratio * height)))

    def _entitle(self) -> None:
        viewer = self.viewer
        state = (" ..." if viewer.busy or not viewer.finished
                 else " (coarse)" if viewer.held_back is not None else "")
        title = f"gpgpu-rt: {viewer.scene.name}, {viewer.selection.method}{state}"
        if title != self._title:
            self.wnd.title = self._title = title

    def _draw_picture(self) -> None:
        image = self.viewer.image
        if image is None:
            return
        if self._shown != self.viewer.version:
            smooth = self.viewer.mode == MODES[0]
            self._picture = self.link.picture("picture", image, smooth)
            self._shown = self.viewer.version
        rect = self.panels.layout.picture
        imgui.get_background_draw_list().add_image(
            self._picture, imgui.ImVec2(rect.x, rect.y),
            imgui.ImVec2(rect.x + rect.width, rect.y + rect.height))

    def _rest(self) -> None:
        if (self.viewer.finished and not self._held
                and time.perf_counter() - self._last_event > QUIET):
            time.sleep(PAUSE)

    def _measure(self, changed: bool) -> None:
        now = time.perf_counter()
        if changed and not self.viewer.at_rest:
            if self._last_update:
                self._updates.append(now - self._last_update)
            self._last_update = now
        elif self.viewer.at_rest:
            self._last_update = 0.0
        if changed and self.viewer.divisor == 1 and self.viewer.settled_after is not None:
            self._settled.append(self.viewer.settled_after)

    def measured(self) -> dict[str, Any]:
        return {"frames": self._frames, "message": self.viewer.message,
                "pictures_while_moving": len(self._updates),
                "updates_per_second": 1 / median(self._updates) if self._updates else None,
                "seconds_to_full_quality": self._settled, "settings": self.viewer.settings()}

    # Events ---------------------------------------------------------------------------------

    def _event(self) -> None:
        self._last_event = time.perf_counter()

    def _pixel(self, x: int, y: int) -> tuple[int, int]:
        """Return the picture's pixel at a position in the window."""
        rect = self.panels.layout.picture
        return tuple(int(p * b / s) for p, b, s in zip(     # type: ignore[return-value]
            (x - rect.x, y - rect.y), self.viewer.size, rect.size))

    def on_resize(self, width: int, height: int) -> None:
        if hasattr(self, "viewer"):     # the first event arrives before the viewer is made
            self._event()

    def on_iconify(self, iconified: bool) -> None:
        self.link.let_go()

    def _dropped(self, window: Any, paths: list[str]) -> None:
        self._event()
        if paths:
            self.viewer.open(paths[0])

    def on_mouse_position_event(self, x: int, y: int, dx: int, dy: int) -> None:
        self._event()
        self._mouse = (x, y)
        self.link.mouse_at(x, y)

    def on_mouse_press_event(self, x: int, y: int, button: int) -> None:
        self._event()
        self._mouse = (x, y)
        self.link.mouse_at(x, y)
        self.link.button(button, True)
        self._press = Press(x, y, button)

    def on_mouse_release_event(self, x: int, y: int, button: int) -> None:
        self._event()
        self._mouse = (x, y)
        self.link.mouse_at(x, y)
        self.link.button(button, False)
        if self._press is not None:
            self._press.released = True

    def on_mouse_drag_event(self, x: int, y: int, dx: int, dy: int) -> None:
        self._event()
        self._mouse = (x, y)
        self.link.mouse_at(x, y)
        if self._press is not None:
            self._press.dx += dx
            self._press.dy += dy

    def _follow_mouse(self) -> None:
        """Apply the mouse's movement since the last frame. Call this after the frame has begun:
        only then does ImGui know whether a button was pressed over a panel."""
        press = self._press
        if press is None:
            return
        if press.over_panel is None:
            press.over_panel = self.link.has_mouse
        if press.released:
            self._press = None
        if press.over_panel:
            return
        dx, dy, press.dx, press.dy = press.dx, press.dy, 0, 0
        press.moved += abs(dx) + abs(dy)
        if press.moved < CLICK:
            if press.released and press.button == self.wnd.mouse.left:
                self.viewer.follow(self._pixel(press.x, press.y))
        elif press.button == self.wnd.mouse.left:
            turn, way = (moves.look, -1) if self.flying else (moves.orbit, 1)
            self.viewer.camera = turn(self.viewer.camera, -TURN * dx, way * TURN * dy)
        else:
            height = self.panels.layout.picture.height
            self.viewer.camera = moves.pan(self.viewer.camera, -dx / height, dy / height)

    def on_mouse_scroll_event(self, x_offset: float, y_offset: float) -> None:
        self._event()
        if self.link.has_mouse:
            self.link.wheel(x_offset, y_offset)
        elif self.flying:
            self.viewer.camera = moves.fly(self.viewer.camera, 0, 0,
                                           0.05 * self._extent() * y_offset)
        else:
            self.viewer.camera = moves.approach(self.viewer.camera, 0.9 ** y_offset)

    def on_unicode_char_entered(self, char: str) -> None:
        self._event()
        self.link.text(char)

    def on_key_event(self, key: Any, action: Any, modifiers: Any) -> None:
        self._event()
        self.link.key(key, action != self.wnd.keys.ACTION_RELEASE, modifiers)

    def _follow_keys(self) -> None:
        """Run the actions of keys that do not go to a panel.

        Call this after the frame has begun. In a slow frame, a click into a text field and the
        typed text arrive together. Only after the frame has begun does ImGui know that the text
        belongs to the field.
        """
        keys, link, viewer = self.wnd.keys, self.link, self.viewer
        self._held = set()
        if link.io.key_ctrl:
            if link.pressed(keys.Q):
                self.wnd.close()
            return
        if link.has_keys:
            if link.has_popup and link.pressed(keys.ESCAPE):
                link.close_popup()
            return
        self._held = {key for key in (keys.W, keys.A, keys.S, keys.D, keys.Q, keys.E)
                      if link.held(key)}
        shift = link.io.key_shift
        for key, action in {
            keys.C: self._change_flight, keys.R: viewer.reset_camera, keys.P: self._save,
            keys.H: self._change_help, keys.TAB: self._change_panels,
            keys.T: self._change_program, keys.ENTER: viewer.insist,
            keys.ESCAPE: self._close_what_is_open,
            keys.M: lambda: self._next_method(-1 if shift else 1),
            **{getattr(keys, f"NUMBER_{k + 1}"): lambda mode=mode: viewer.look_at(mode)
               for k, mode in enumerate(MODES)},
        }.items():
            if link.pressed(key):
                action()
        for key, way in ((keys.LEFT, -1), (keys.RIGHT, 1)):
            if link.pressed(key, repeat=True):
                viewer.go_to(viewer.index + (10 if shift else 1) * way)
        for key, way in ((keys.UP, -1), (keys.DOWN, 1)):
            if viewer.path is not None and link.pressed(key, repeat=True):
                viewer.path.go((10 if shift else 1) * way)

    # Actions of keys ------------------------------------------------------------------------

    def _fly(self, seconds: float) -> None:
        keys, held = self.wnd.keys, self._held
        way = np.array([(keys.D in held) - (keys.A in held), (keys.E in held) - (keys.Q in held),
                        (keys.W in held) - (keys.S in held)], np.float64)
        if way.any():
            fast = 4.0 if self.link.io.key_shift else 1.0
            self.viewer.camera = moves.fly(self.viewer.camera,
                                           *(way * fast * FLY * self._extent() * seconds))

    def _extent(self) -> float:
        return self.viewer.scene.extent or 1.0

    def _change_flight(self) -> None:
        self.flying = not self.flying
        self.viewer.message = ("Flying: drag to look around; W, A, S, D, Q and E move the camera."
                               if self.flying else "Turning: drag to turn around the scene.")

    def _change_help(self) -> None:
        self.panels.help = not self.panels.help

    def _change_program(self) -> None:
        self.panels.program.shown = not self.panels.program.shown

    def _change_panels(self) -> None:
        self.panels.shown = not self.panels.shown

    def _close_what_is_open(self) -> None:
        self.panels.help = self.panels.program.shown = False
        self.viewer.path, self.viewer.message = None, ""

    def _next_method(self, by: int) -> None:
        names = [row.name for row in methods()]
        chosen = self.viewer.selection
        self.viewer.choose(chosen.with_method(
            names[(names.index(chosen.method) + by) % len(names)]))

    def _save(self) -> None:
        self.viewer.save(self.folder)
