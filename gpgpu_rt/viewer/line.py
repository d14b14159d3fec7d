"""Line: writes the shell command and the settings of the viewer's picture."""
from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from ..methods import find_method
from ..options import TRACER_OPTIONS
from .selection import DECIDED, camera_words, option_words

if TYPE_CHECKING:
    from .model import Viewer


def line_of(viewer: Viewer) -> tuple[str, str]:
    """Return the shell command that makes the shown picture, and a note about the command's
    result. If no command makes the picture, return "" and the reason."""
    if viewer.mode == "picture":
        return (viewer.selection.line(viewer.view, viewer.size, f"{viewer.scene.name}.png",
                                      viewer.scene.camera),
                "draws the same picture, to the bit")
    return _heat(viewer) if viewer.mode == "heat" else _passes(viewer)


def _heat(viewer: Viewer) -> tuple[str, str]:
    view, chosen = viewer.heat, viewer.selection
    rows = view.traced(chosen.method, chosen.options)
    if rows[-1][1] != rows[0][1]:
        return "", ("no command makes this: gpgpu-rt heat gives all methods the same options, "
                    f"but {rows[-1][0]} does not have the options of {rows[0][0]}")
    width, height = view.size_of_one(viewer.size)
    words = ["heat", chosen.scene, *(f"--method={name}" for name, _ in rows),
             f"--what={view.what}", *_option_words(chosen.method, rows[0][1]),
             f"--size={width}x{height}", *camera_words(viewer.view, viewer.scene.camera),
             f"--output={viewer.scene.name}-heat.png"]
    return (shlex.join(["gpgpu-rt", *words]),
            "draws the same counts on the same scale, each map whole and with a title")


def _passes(viewer: Viewer) -> tuple[str, str]:
    chosen = viewer.selection
    if viewer.failed:
        return "", f"no command makes this: {viewer.failed}"
    width, height = viewer.journey_size
    words = ["passes", chosen.scene, f"--method={chosen.method}",
             *_option_words(chosen.method, _in_passes(viewer)),
             f"--size={width}x{height}", *camera_words(viewer.view, viewer.scene.camera),
             f"--output={viewer.scene.name}-passes"]
    return (shlex.join(["gpgpu-rt", *words]),
            "writes a picture of every pass to a folder; same rays, but another layout")


def _in_passes(viewer: Viewer) -> dict[str, Any]:
    return find_method(viewer.selection.method).in_passes(viewer.selection.options)


def _option_words(method: str, options: dict[str, Any]) -> list[str]:
    return option_words({k: v for k, v in options.items() if k not in DECIDED},
                        TRACER_OPTIONS + find_method(method).options)


def settings_of(viewer: Viewer) -> dict[str, Any]:
    """Return all settings of the shown picture. ``command`` is None if there is no command."""
    chosen = viewer.selection
    command, note = line_of(viewer)
    found = {"scene": chosen.scene, "triangles": len(viewer.scene), "method": chosen.method,
             "options": {k: v for k, v in viewer.tracer.options.items() if k != "context"},
             "integrator": chosen.integrator, "light": dict(chosen.light),
             "camera": viewer.view.to_dict(), "size": list(viewer.size), "mode": viewer.mode,
             "gpu": viewer.gpu.info(), "command": command or None, "command_note": note}
    if viewer.mode == "heat":
        view = viewer.heat
        found["heat"] = {
            "what": view.what, "other": view.other, "layout": view.layout, "wipe": view.wipe,
            "scale_ends_at": view.top,
            "maps": [{"method": name, "options": options}
                     for name, options in view.traced(chosen.method, chosen.options)]}
    elif viewer.mode == "passes":
        journey = viewer.journey
        found["passes"] = {
            "pass": None if journey is None else journey.kept[viewer.index].number,
            "field": viewer.field, "size": list(viewer.journey_size),
            "options": _in_passes(viewer)}
    return found
