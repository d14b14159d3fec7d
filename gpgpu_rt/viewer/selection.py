"""Selection: the viewer's scene, method and options, and the command that draws their picture."""
from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..methods import Method, find_method
from ..options import TRACER_OPTIONS, Option, spell
from ..render.integrators import DEFAULT, find_integrator
from ..scene.camera import Camera
from ..tracer import DEFAULT_METHOD

# Options that panels omit: the viewer sets context and statistics itself, and presort does not
# affect eye rays.
DECIDED = ("context", "statistics", "presort")


def word(value: Any) -> str:
    """Return an option's value as the command line writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return "none" if value is None else spell(value)


def option_words(options: Mapping[str, Any], known: tuple[Option, ...]) -> list[str]:
    table = {option.name: option for option in known}
    words = []
    for name, value in options.items():
        text = word(value)
        # `word` writes a tuple as 4x2. If the option has no choices, the tuple is a vector: write
        # it as x,y,z.
        if table[name].choices is None and isinstance(value, tuple):
            text = ",".join(map(str, value))
        words.append(f"--{name.replace('_', '-')}={text}")
    return words


def camera_words(camera: Camera, own: Camera | None = None) -> list[str]:
    """Return arguments such as ``--eye=x,y,z``, which give the same camera to the bit. Leave out
    parts that equal those of ``own``, the scene's camera."""
    parts = {"eye": camera.eye, "target": camera.target, "up": camera.up, "fov": (camera.fov,)}
    known = {} if own is None else {"eye": own.eye, "target": own.target, "up": own.up,
                                    "fov": (own.fov,)}
    return [f"--{name}={','.join(map(_shortest, numbers))}" for name, numbers in parts.items()
            if numbers != known.get(name)]


def _shortest(number: float) -> str:
    return repr(number).removesuffix(".0")


@dataclass(frozen=True)
class Selection:
    """All settings of a picture except the camera.

    Attributes
    ----------
    scene : a scene's name or a file's path
    method : a name from the method table
    options : options of the tracer and the method that differ from their defaults
    integrator : a name from ``INTEGRATORS``
    light : options of the integrator that differ from their defaults
    """

    scene: str = "bunny"
    method: str = DEFAULT_METHOD
    options: Mapping[str, Any] = field(default_factory=dict)
    integrator: str = DEFAULT
    light: Mapping[str, Any] = field(default_factory=dict)

    @property
    def row(self) -> Method:
        return find_method(self.method)

    def known(self) -> tuple[Option, ...]:
        """Return the options that the panels offer, the method's own first. For ``schedule``,
        the panels offer only the schedules that the other options allow."""
        return tuple(self._narrowed(option) for option in self.row.options + TRACER_OPTIONS
                     if option.name not in DECIDED)

    def _narrowed(self, option: Option) -> Option:
        if option.name != "schedule":
            return option
        return replace(option, choices=self.row.schedules_for(self.options))

    def light_options(self) -> tuple[Option, ...]:
        return find_integrator(self.integrator).options

    def with_method(self, name: str) -> Selection:
        """Return the selection with another method. Keep the options that the method accepts."""
        other = replace(self, method=find_method(name).name, options={})
        known = {option.name: option for option in other.known()}
        kept = {option: value for option, value in self.options.items()
                if option in known and known[option].accepts(value)}
        if kept.get("schedule") not in (None, *other.row.schedules_for(kept)):
            del kept["schedule"]
        if other.row.steps_once:    # the method runs only one step per pass
            kept.pop("steps_per_pass", None)
        return replace(other, options=kept)

    def with_option(self, name: str, value: Any) -> Selection:
        """Return the selection with a changed option. Raise OptionError for an invalid value."""
        return replace(self, options=_set(self.options, self.known(), name, value))

    def with_integrator(self, name: str) -> Selection:
        """Return the selection with a new integrator. Keep options that the integrator accepts."""
        known = {option.name: option for option in find_integrator(name).options}
        light = {option: value for option, value in self.light.items()
                 if option in known and known[option].accepts(value)}
        return replace(self, integrator=name, light=light)

    def with_light(self, name: str, value: Any) -> Selection:
        return replace(self, light=_set(self.light, self.light_options(), name, value))

    def words(self, camera: Camera, size: tuple[int, int], output: str,
              own: Camera | None = None) -> list[str]:
        """Return the arguments with which `gpgpu-rt` writes the same picture. ``own`` is the
        scene's camera."""
        words = ["render", self.scene, f"--method={self.method}"]
        words += option_words(self.options, TRACER_OPTIONS + self.row.options)
        if self.integrator != DEFAULT:
            words.append(f"--integrator={self.integrator}")
        words += option_words(self.light, self.light_options())
        return [*words, f"--size={size[0]}x{size[1]}", *camera_words(camera, own),
                f"--output={output}"]

    def line(self, camera: Camera, size: tuple[int, int], output: str,
             own: Camera | None = None) -> str:
        """Return the command of `words` as a line for a shell."""
        return shlex.join(["gpgpu-rt", *self.words(camera, size, output, own)])


def _set(options: Mapping[str, Any], known: tuple[Option, ...], name: str,
         value: Any) -> dict[str, Any]:
    option = next(o for o in known if o.name == name)
    changed = {**options, name: option.check(value)}
    if changed[name] == option.default:
        del changed[name]
    return changed
