"""Ray tracing on graphics hardware, as fragment programs did it in 2002-2007.

A scene has triangles. A tracer has a scene and a method, such as "kd-restart". The method's
fragment programs find the hits of rays. All methods find the same hits, at different costs::

    import gpgpu_rt as rt

    scene = rt.load_scene("bunny")              # a name, a mesh file or a trimesh.Trimesh
    with rt.Tracer(scene, "kd-restart", statistics=True) as tracer:
        origins, directions = scene.camera.rays((512, 512))     # (512, 512, 3) each, world units
        hits = tracer.trace(origins, directions)
        print(hits)                 # hits.triangle; hits.t, (n,), in units of |direction|
        print(tracer.statistics)                # passes, seconds, nodes per ray
        tracer.render(size=(512, 512)).save("bunny.png")        # a Pillow image

Further reading:

- ``rt.methods()`` lists the methods; ``gpgpu-rt methods NAME`` prints the options of a method.
- ``help(rt.Tracer)`` describes tracing, pictures and moving triangles, and lists the options of
  all methods. ``help(rt.Hits)`` describes the result.
- ``rt.reference.trace`` finds the nearest hits in float64, by brute force.
- ``rt.load_animation`` loads a scene that moves; ``rt.Scene``, ``rt.Material`` and ``rt.Camera``
  make a scene of your own.
- A wrong scene, method, option or setting raises an ``rt.Error``, and wrong ray arrays raise a
  ValueError. The message says what to do.
- README.md and docs/ describe the commands, the viewer and the figures. The notebook
  examples/tour.ipynb shows the package step by step.
"""
from __future__ import annotations

import importlib
import sys
import types

TYPE_CHECKING = False    # True for type checkers; `typing` itself takes milliseconds to import
if TYPE_CHECKING:
    from typing import Any

    from . import reference
    from .errors import (
        ContextError, Error, LimitError, MethodError, OptionError, SceneError, SettingsError,
        ShaderError
    )
    from .hits import Hits
    from .methods import Method, load_methods, methods
    from .methods.choices import Choice, Choices
    from .methods.geometry_image.deformation import Deformation
    from .scene.animation import Animation, load_animation
    from .scene.camera import Camera
    from .scene.light import Environment, PointLight
    from .scene.loading import load_scene
    from .scene.material import Material
    from .scene.scene import Scene
    from .scene.surfaces.geometry_image import GeometryImage
    from .scene.surfaces.parametrise import remesh
    from .scene.texture import Texture
    from .tracer import Tracer

# The module of each public name. The first use of a name imports its module, so the commands can
# handle interrupts before libraries load, and an error message need not wait for OpenGL.
_HOMES = {
    "Animation": "scene.animation", "load_animation": "scene.animation",
    "Environment": "scene.light", "PointLight": "scene.light", "Material": "scene.material",
    "Texture": "scene.texture", "Camera": "scene.camera", "Choice": "methods.choices",
    "Choices": "methods.choices", "ContextError": "errors", "Error": "errors",
    "LimitError": "errors", "MethodError": "errors", "OptionError": "errors",
    "SceneError": "errors", "SettingsError": "errors", "ShaderError": "errors", "Hits": "hits",
    "Method": "methods", "load_methods": "methods", "methods": "methods", "Scene": "scene.scene",
    "load_scene": "scene.loading", "Deformation": "methods.geometry_image.deformation",
    "GeometryImage": "scene.surfaces.geometry_image", "remesh": "scene.surfaces.parametrise",
    "Tracer": "tracer"}

__version__ = "0.1.0"

__all__ = [
    "Animation", "Camera", "Choice", "Choices", "ContextError", "Deformation", "Environment",
    "Error", "GeometryImage", "Hits", "LimitError", "Material", "Method", "MethodError",
    "OptionError", "PointLight", "Scene", "SceneError", "SettingsError", "ShaderError",
    "Texture", "Tracer", "load_animation", "load_methods", "load_scene", "methods", "reference",
    "remesh"]


class _Package(types.ModuleType):
    """The class of this package.

    The public name `gpgpu_rt.methods` is a function. An import of the module `methods` would
    replace the function, because Python assigns an imported module to its name in the package.
    This class ignores such assignments.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, types.ModuleType)):
            super().__setattr__(name, value)


def __getattr__(name: str) -> Any:
    """Import a public name or a module of this package at its first use, and return it."""
    if name in _HOMES:
        value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    if not name.startswith("_"):
        try:
            return importlib.import_module(f"{__name__}.{name}")
        except ModuleNotFoundError as failure:
            if failure.name != f"{__name__}.{name}":
                raise
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)


sys.modules[__name__].__class__ = _Package
