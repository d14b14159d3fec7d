"""Settings: a file of methods and options that were measured on one scene and one renderer.

`tune` writes the settings to the user's file and to the cache folder, where ``method="auto"``
looks for the settings of the scene's triangles and the renderer.
"""
from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..accel.cache import cache_folder
from ..disk.files import read_json, replacing
from ..disk.own_folder import is_own
from ..errors import Error, OptionError, SettingsError, nearest_names
from ..scene.scene import Scene
from . import find_method
from .choices import COHERENT, INCOHERENT, PASSING, RAYS, Choice, Choices

FORMAT = 2
ONE_CHOICE = 1    # the older format, which has one choice for all rays
# The choices for a scene that was not tuned. Both give exact hits, and no other choice that does
# was found to be much faster. Packets trace coherent rays faster than single rays do, but
# incoherent rays more slowly (docs/notes/schedules.md); for entry points see docs/notes/bvh.md.
# interval_test is off: it makes packets of mirror rays, which count as coherent, slower than
# single rays.
SAFE_DEFAULT = {
    COHERENT: ("bvh-packet", {"packet": (4, 2), "octants": True, "quantise_nodes": 16,
                              "entry_points": 32}),
    INCOHERENT: ("bvh-threaded", {"octants": True, "quantise_nodes": 16})}


@dataclass(frozen=True)
class Settings:
    """Choices with the scene and the renderer on which they were measured.

    Attributes
    ----------
    scene : the scene's "name", number of "triangles" and the "sha256" of its triangles
    renderer : OpenGL's name of the renderer
    """

    scene: dict[str, Any]
    renderer: str
    choices: Choices

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the settings to a file, completely or not at all."""
        entries = {"format": FORMAT, "scene": self.scene, "renderer": self.renderer,
                   **asdict(self.choices)}
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")

    def check_fits(self, scene: Scene, renderer: str, where: str = "settings") -> None:
        """Raise SettingsError if scene or renderer differs; the message names the difference."""
        here = describe(scene)
        advice = "tune again, or pass force=True (--force)"
        if here["sha256"] != self.scene["sha256"]:
            same_name = here["name"] == self.scene["name"]
            raise SettingsError(
                f"{where}: measured on scene {self.scene['name']} with {self.scene['triangles']} "
                f"triangles, but this scene is {here['name']} with {here['triangles']}"
                + (f" and has other triangles (SHA-256 {here['sha256'][:8]} instead of "
                   f"{self.scene['sha256'][:8]})" if same_name else "") + f"; {advice}")
        if renderer != self.renderer:
            raise SettingsError(f"{where}: measured on renderer {self.renderer!r}, but this "
                                f"renderer is {renderer!r}; {advice}")


def describe(scene: Scene) -> dict[str, Any]:
    """Return the scene's name, its number of triangles, and the SHA-256 of the triangles."""
    return {"name": scene.name, "triangles": len(scene),
            "sha256": hashlib.sha256(scene.triangles).hexdigest()}


def load(path: str | os.PathLike[str]) -> Settings:
    """Read settings from a file.

    Raises
    ------
    SettingsError
        if the file cannot be read, or a key is missing or invalid; the message names the key
    """
    try:
        entries = read_json(path)
    except OSError as failure:
        raise SettingsError(f"cannot read settings from {path}: {failure.strerror}") from failure
    except ValueError as failure:
        raise SettingsError(f"{path}: not JSON ({failure}); write the file with `gpgpu-rt tune`"
                            ) from failure
    if not isinstance(entries, dict):
        raise SettingsError(f"{path}: no JSON object; write the file with `gpgpu-rt tune`")
    return _checked(entries, str(path))


def store(settings: Settings) -> Path | None:
    """Write settings to the cache folder, in which `find` looks.

    Returns
    -------
    the file, or None if there is no cache folder or the file cannot be written
    """
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
    """Return the cached settings for a scene and a renderer, or None. Warn of unusable ones."""
    path = _path(describe(scene)["sha256"], renderer)
    try:
        if path is None or not path.is_file() or not is_own(path.stat()):
            return None
        settings = load(path)
        settings.check_fits(scene, renderer)
    # The file is damaged, not readable, or written by a version with other methods or options.
    except (Error, OSError) as failure:
        _warn_of_default(failure, 4)
        return None
    return settings


def automatic(scene: Scene, renderer: str, options: Mapping[str, Any]
              ) -> tuple[Choices, Settings | None]:
    """Return the choices of ``method="auto"``, and their settings (None for SAFE_DEFAULT).

    Cached settings are used if they allow the caller's options; otherwise SAFE_DEFAULT with these
    options. If the coherent default does not accept the options, first its entry points are
    dropped. If that does not help, the incoherent default serves all rays.
    """
    found = find(scene, renderer)
    if found is not None:
        try:
            return found.choices.with_options(options, "the settings file"), found
        except OptionError as failure:
            _warn_of_default(failure, 3)
    coherent, incoherent = (Choice(SAFE_DEFAULT[rays][0], {**SAFE_DEFAULT[rays][1], **options})
                            for rays in RAYS)
    plain = Choice(coherent.method, {name: value for name, value in coherent.options.items()
                                     if name != "entry_points" or name in options})
    try:
        incoherent.resolved()
    except OptionError as failure:
        raise OptionError(f"method auto uses {coherent.method} for coherent rays and "
                          f"{incoherent.method} for other rays: {failure}; or name the method "
                          "that has the option") from failure
    fitting = next((choice for choice in (coherent, plain)
                    if find_method(choice.method).takes(choice.options)), incoherent)
    return Choices(fitting, incoherent), None


def _warn_of_default(failure: Error, level: int) -> None:
    warnings.warn("auto uses the safe default instead of the settings that `tune` stored: "
                  f"{failure}", stacklevel=level + 1)


def _path(digest: str, renderer: str) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    key = hashlib.sha256(f"{digest} {renderer}".encode()).hexdigest()
    return folder / f"settings-{key}.json"


_KEYS: dict[str, type] = {"format": int, "scene": dict, "renderer": str}
_CHOICE_KEYS: dict[str, type] = {"method": str, "options": dict, "promise": dict,
                                 "measured": dict}
_SCENE_KEYS: dict[str, type] = {"name": str, "triangles": int, "sha256": str}


def _checked(entries: dict[str, Any], where: str) -> Settings:
    single = entries.get("format") == ONE_CHOICE and entries["format"] is not True
    _check_keys(entries, {**_KEYS, **(_CHOICE_KEYS if single else dict.fromkeys(RAYS, dict))},
                where, "")
    if not single and entries["format"] != FORMAT:
        raise SettingsError(f"{where}: format is {entries['format']}, but this version reads "
                            f"{ONE_CHOICE} and {FORMAT}; write the file with `gpgpu-rt tune`")
    _check_keys(entries["scene"], _SCENE_KEYS, where, "scene.")
    if single:
        choices = Choices.one(_choice({name: entries[name] for name in _CHOICE_KEYS}, where, ""))
    else:
        choices = Choices(*(_choice(entries[rays], where, f"{rays}.") for rays in RAYS))
    return Settings(entries["scene"], entries["renderer"], choices)


def _choice(entries: dict[str, Any], where: str, prefix: str) -> Choice:
    _check_keys(entries, _CHOICE_KEYS, where, prefix)
    try:
        find_method(entries["method"])
    except OptionError as failure:
        raise SettingsError(f"{where}: {prefix}method: {failure}") from None
    given = entries["options"]
    for name in PASSING:
        if name in given:
            raise SettingsError(f"{where}: {prefix}options.{name} does not belong in a settings "
                                "file; remove the key")
    try:
        known = Choice(entries["method"], given).resolved()[1]
    except OptionError as failure:
        raise SettingsError(f"{where}: {prefix}options: {failure}") from None
    # JSON has no tuples: replace a list by the tuple of `known`.
    own = {name: known[name] if isinstance(value, list) else value
           for name, value in given.items()}
    return Choice(**{**entries, "options": own})


def _check_keys(entries: Mapping[str, Any], known: Mapping[str, type], where: str,
                prefix: str) -> None:
    for name in entries:
        if name not in known:
            raise SettingsError(f"{where}: unknown key {prefix}{name}"
                                + nearest_names(name, known))
    for name, kind in known.items():
        if name not in entries:
            raise SettingsError(f"{where}: {prefix}{name} is missing; write the file with "
                                "`gpgpu-rt tune`")
        if not isinstance(entries[name], kind) or isinstance(entries[name], bool):
            raise SettingsError(f"{where}: {prefix}{name} is {entries[name]!r}; it must be "
                                f"{kind.__name__}")
