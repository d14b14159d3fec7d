"""Settings: a method and options that were measured on one scene and renderer, kept as a file.

`tune` writes them, as a file of the user's and in the cache folder, where ``method="auto"`` finds
them again by the scene's triangles and the renderer.
"""
from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from .accel.cache import cache_folder
from .errors import Error, OptionError, SettingsError, nearest_names
from .files import replacing
from .methods import find_method
from .options import TRACER_OPTIONS, resolve_options
from .scene import Scene

FORMAT = 1
# What is used where nothing was tuned: right to the bit, and never far from the fastest.
SAFE_DEFAULT = ("bvh-threaded", {"octants": True})
# Options that say how a call is watched, not how it is traced; a file does not hold them.
PASSING = ("statistics", "context")


@dataclass(frozen=True)
class Settings:
    """A method with options, and what they were measured on.

    Attributes
    ----------
    scene : "name", "triangles" (how many) and "sha256" of the scene's triangles
    renderer : OpenGL's name for what it was measured on
    method, options : as `Tracer` takes them
    promise : the bounds that were asked for, see `promise.Promise`
    measured : what was found: rays, wrong, upper_95, t_error, rays_per_second, bytes, ...
    """

    scene: dict[str, Any]
    renderer: str
    method: str
    options: dict[str, Any]
    promise: dict[str, Any] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file, whole or not at all."""
        with replacing(path) as temporary:
            temporary.write_text(json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n",
                                 encoding="utf-8")

    def check_fits(self, scene: Scene, renderer: str, where: str = "settings") -> None:
        """Raise SettingsError, naming the difference, for another scene or renderer."""
        here = describe(scene)
        advice = "tune again, or pass force=True (--force)"
        if here["sha256"] != self.scene["sha256"]:
            same_name = here["name"] == self.scene["name"]
            raise SettingsError(
                f"{where}: measured on scene {self.scene['name']} with {self.scene['triangles']} "
                f"triangles, this is {here['name']} with {here['triangles']}"
                + (f", triangles of another content ({self.scene['sha256'][:8]} against "
                   f"{here['sha256'][:8]})" if same_name else "") + f"; {advice}")
        if renderer != self.renderer:
            raise SettingsError(f"{where}: measured on renderer {self.renderer!r}, this is "
                                f"{renderer!r}; {advice}")

    def with_options(self, options: Mapping[str, Any], where: str = "settings") -> dict[str, Any]:
        """The options with the caller's added: those of ``PASSING``; any other is refused, unless
        it asks for what the settings say."""
        for name, value in options.items():
            if name in PASSING or name in self.options and value == self.options[name]:
                continue
            said = f"say {name}={self.options[name]}" if name in self.options else "decide that"
            raise OptionError(f"option {name}={value}: {where} {said}; leave it out, or go "
                              "without the settings")
        return {**self.options, **options}


def describe(scene: Scene) -> dict[str, Any]:
    """A scene's name, its number of triangles and the SHA-256 of their float32 coordinates."""
    return {"name": scene.name, "triangles": len(scene),
            "sha256": hashlib.sha256(scene.triangles).hexdigest()}


def load(path: str | os.PathLike[str]) -> Settings:
    """Settings from a file.

    Raises
    ------
    SettingsError
        a file that cannot be read, or naming the key that is missing or of no use
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as failure:
        reason = getattr(failure, "strerror", None) or "not a text file"
        raise SettingsError(f"cannot read settings from {path}: {reason}") from failure
    try:
        entries = json.loads(text)
    except ValueError as failure:
        raise SettingsError(f"{path}: not JSON ({failure}); write it with `gpgpu-rt tune`"
                            ) from failure
    if not isinstance(entries, dict):
        raise SettingsError(f"{path}: expected an object; write it with `gpgpu-rt tune`")
    return _checked(entries, str(path))


def store(settings: Settings) -> Path | None:
    """Keep settings where `find` looks; the file, or None where nothing can be kept."""
    path = _path(settings.scene["sha256"], settings.renderer)
    if path is None:
        return None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        settings.save(path)
    except (OSError, Error):
        return None
    return path


def find(scene: Scene, renderer: str) -> Settings | None:
    """The settings kept for a scene and a renderer; None where there are none of any use."""
    path = _path(describe(scene)["sha256"], renderer)
    if path is None or not path.is_file():
        return None
    try:
        settings = load(path)
        settings.check_fits(scene, renderer)
    except Error:     # damaged, or written by a version with other methods or options
        return None
    return settings


def automatic(scene: Scene, renderer: str, options: Mapping[str, Any]
              ) -> tuple[str, dict[str, Any], Settings | None]:
    """Method and options of ``method="auto"``, and the settings they came from.

    Those kept for the scene and renderer, where they agree with what the caller asks for; else a
    safe default.
    """
    settings = find(scene, renderer)
    if settings is not None:
        try:
            chosen = settings.with_options(options)
            _resolve(settings.method, chosen)
            return settings.method, chosen, settings
        except OptionError:
            pass
    method, defaults = SAFE_DEFAULT
    return method, {**defaults, **options}, None


def _path(digest: str, renderer: str) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    key = hashlib.sha256(f"{digest} {renderer}".encode()).hexdigest()
    return folder / f"settings-{key}.json"


def _resolve(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    row = find_method(method)
    return resolve_options(options, TRACER_OPTIONS + row.options, f"method {method}")


_KEYS: dict[str, type] = {"format": int, "scene": dict, "renderer": str, "method": str,
                          "options": dict, "promise": dict, "measured": dict}
_SCENE_KEYS: dict[str, type] = {"name": str, "triangles": int, "sha256": str}


def _checked(entries: dict[str, Any], where: str) -> Settings:
    _check_keys(entries, _KEYS, where, "")
    if entries["format"] != FORMAT:
        raise SettingsError(f"{where}: format is {entries['format']}, this version reads "
                            f"{FORMAT}; write it anew with `gpgpu-rt tune`")
    _check_keys(entries["scene"], _SCENE_KEYS, where, "scene.")
    try:
        find_method(entries["method"])
    except OptionError as failure:
        raise SettingsError(f"{where}: method: {failure}") from None
    for name in PASSING:
        if name in entries["options"]:
            raise SettingsError(f"{where}: options.{name} is not for a settings file; remove it")
    try:
        _resolve(entries["method"], entries["options"])
    except OptionError as failure:
        raise SettingsError(f"{where}: options: {failure}") from None
    return Settings(**{name: entries[name] for name in _KEYS if name != "format"})


def _check_keys(entries: Mapping[str, Any], known: Mapping[str, type], where: str,
                prefix: str) -> None:
    for name in entries:
        if name not in known:
            raise SettingsError(f"{where}: no key {prefix}{name} is known"
                                + nearest_names(name, known))
    for name, kind in known.items():
        if name not in entries:
            raise SettingsError(f"{where}: {prefix}{name} is missing; write the file with "
                                "`gpgpu-rt tune`")
        if not isinstance(entries[name], kind) or isinstance(entries[name], bool):
            raise SettingsError(f"{where}: {prefix}{name} is {entries[name]!r}; it must be "
                                f"{kind.__name__}")
