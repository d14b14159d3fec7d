"""Scene keys: declares the keys of a scene file, for its check and for its JSON schema."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import SceneError, nearest_names
from .values import number, vector


@dataclass(frozen=True)
class Key:
    """A key of an object in a scene file.

    Attributes
    ----------
    kind : "text", "flag", "number", "vector", "size" (one number or three), "points" (four
        vectors), "map of text", the name of an object in ``OBJECTS``, or such a name after "list
        of " or "map of "
    help : the meaning of the key, for the schema and for errors
    required : whether the object must have this key
    least, most : inclusive bounds of the key's numbers
    above : exclusive lower bound of the key's numbers
    """

    kind: str
    help: str
    required: bool = False
    least: float | None = None
    most: float | None = None
    above: float | None = None


_SHARE = {"least": 0, "most": 1}
OBJECTS: Mapping[str, Mapping[str, Key]] = {
    "scene": {
        "name": Key("text", "the scene's name in tables; by default the file's name"),
        "meshes": Key("list of mesh", "the meshes of the scene", required=True),
        "materials": Key("map of material", "the materials by name"),
        "lights": Key("list of light", "the point lights"),
        "environment": Key("environment", "light from outside the scene; by default no light"),
        "camera": Key("camera", "by default a camera that sees the whole scene from outside"),
    },
    "mesh": {
        "file": Key("text", "path of a mesh file, relative to the scene file's folder; or a named "
                    "scene (`gpgpu-rt scenes`)"),
        "box": Key("box", "a box, instead of a file"),
        "sphere": Key("sphere", "a sphere of triangles, instead of a file"),
        "quad": Key("points", "four corners, instead of a file; for a dielectric, anticlockwise "
                    "as seen from outside"),
        "material": Key("text", "the name of the material of the whole mesh"),
        "materials": Key("map of text", "maps the name of a group, object or material in the mesh "
                         "file to the name of the material that it gets"),
        "smooth": Key("flag", "shade with normals that are computed from the triangles and "
                      "interpolated, so that edges look smooth"),
        "scale": Key("size", "first, scale by this factor, or by a factor for each axis", above=0),
        "rotate": Key("vector", "then rotate by degrees around x, then y, then z"),
        "translate": Key("vector", "last, move by this vector"),
    },
    "box": {
        "lo": Key("vector", "its lower corner", required=True),
        "hi": Key("vector", "its upper corner", required=True),
    },
    "sphere": {
        "centre": Key("vector", "its centre", required=True),
        "radius": Key("number", "its radius, world units", required=True, above=0),
        "triangles": Key("number", "largest number of triangles; 1280 by default", least=8,
                         most=1e6),
    },
    "material": {
        "diffuse": Key("vector", "share of the light that is scattered by Lambert's law, for red, "
                       "green and blue", **_SHARE),
        "mirror": Key("vector", "share of the light that is reflected in the mirror direction",
                      **_SHARE),
        "glossy": Key("vector", "share of the light that is reflected into a lobe around the "
                      "mirror direction", **_SHARE),
        "roughness": Key("number", "roughness of the glossy lobe; 0.2 by default", least=0.01,
                         most=1),
        "ior": Key("number", "refractive index; makes the material a dielectric, which "
                   "refracts the light that it does not reflect", least=0.1, most=10),
        "emission": Key("vector", "radiance that the surface emits", least=0),
        "texture": Key("text", "path of an image file, relative to the scene file's folder; the "
                       "image multiplies the diffuse share"),
    },
    "light": {
        "position": Key("vector", "its position, world units", required=True),
        "intensity": Key("vector", "the radiance that a white surface reflects if it faces the "
                         "light, the same at any distance; (1, 1, 1) by default", least=0),
    },
    "environment": {
        "colour": Key("vector", "radiance from all directions", least=0),
        "zenith": Key("vector", "radiance from straight above", least=0),
        "ground": Key("vector", "radiance from straight below", least=0),
        "image": Key("text", "path of an equirectangular image, as an image file or as .npy, "
                     "relative to the scene file's folder"),
        "backdrop": Key("flag", "true: a pale sky, which also surrounds a mesh that is drawn "
                        "without a scene file"),
    },
    "camera": {
        "eye": Key("vector", "its position, world units", required=True),
        "target": Key("vector", "the point at which the camera looks", required=True),
        "up": Key("vector", "the upward direction; (0, 1, 0) by default"),
        "fov_degrees": Key("number", "vertical field of view; 45 by default"),
    },
}


def check(value: Any, kind: str, where: str, key: Key = Key("", "")) -> None:
    """Raise SceneError unless the value has the given kind and its numbers keep the bounds of
    ``key``. The message begins with ``where``."""
    if kind.startswith(("list of ", "map of ")):
        many, _, one = kind.partition(" of ")
        shape = list if many == "list" else dict
        _check_type(value, shape, where, "a list" if shape is list else "an object")
        for name, entry in enumerate(value) if shape is list else value.items():
            check(entry, one, f"{where}[{name}]" if shape is list else f"{where}.{name}")
    elif kind in OBJECTS:
        _check_type(value, dict, where, "an object")
        keys = OBJECTS[kind]
        for name in value:
            if name not in keys:
                raise SceneError(f"{where}: unknown key {name!r}{nearest_names(name, keys)}")
        for name, declared in keys.items():
            if name in value:
                check(value[name], declared.kind, f"{where}.{name}", declared)
            elif declared.required:
                raise SceneError(f"{where}: no {name!r}; add it ({declared.help})")
    elif kind == "text":
        _check_type(value, str, where, "text")
    elif kind == "flag":
        _check_type(value, bool, where, "true or false")
    elif kind == "points":
        _check_type(value, list, where, "four points")
        if len(value) != 4:
            raise SceneError(f"{where} has {len(value)} points; give four")
        for k, point in enumerate(value):
            vector(point, f"{where}[{k}]")
    else:
        _check_numbers(value, kind, where, key)


def _check_numbers(value: Any, kind: str, where: str, key: Key) -> None:
    least = -float("inf") if key.least is None else key.least
    most = float("inf") if key.most is None else key.most
    if kind == "vector" or (kind == "size" and isinstance(value, list)):
        numbers = vector(value, where, least, most)
    else:
        numbers = (number(value, where, least, most),)
    if key.above is not None and min(numbers) <= key.above:
        raise SceneError(f"{where} is {value}; give more than {key.above:g}")


def _check_type(value: Any, kind: type, where: str, what: str) -> None:
    if not isinstance(value, kind):
        raise SceneError(f"{where} is {str(value)[:60]!r}; give {what}")


def schema() -> dict[str, Any]:
    """Return the JSON schema of a scene file."""
    objects = {}
    for name, keys in OBJECTS.items():
        entry = {"type": "object", "additionalProperties": False, "properties": {
            word: {**_schema_of(key), "description": key.help} for word, key in keys.items()}}
        required = [word for word, key in keys.items() if key.required]
        objects[name] = {**entry, "required": required} if required else entry
    return {"$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": "gpgpu_rt scene file", "$ref": "#/$defs/scene", "$defs": objects}


def _schema_of(key: Key) -> dict[str, Any]:
    many, _, one = key.kind.partition(" of ")
    inner = one or many
    bounds = {word: value for word, value in (
        ("minimum", key.least), ("maximum", key.most), ("exclusiveMinimum", key.above))
        if value is not None}
    one_number = {"type": "number", **bounds}
    three = {"type": "array", "items": one_number, "minItems": 3, "maxItems": 3}
    simple: dict[str, dict[str, Any]] = {
        "text": {"type": "string"}, "flag": {"type": "boolean"}, "number": one_number,
        "vector": three, "size": {"anyOf": [one_number, three]},
        "points": {"type": "array", "items": three, "minItems": 4, "maxItems": 4}}
    found = simple[inner] if inner in simple else {"$ref": f"#/$defs/{inner}"}
    if not one:
        return found
    if many == "list":
        return {"type": "array", "items": found}
    return {"type": "object", "additionalProperties": found}
