"""Ray tracing on graphics hardware, as fragment programs did it in 2002-2007."""
from . import reference
from .animation import Animation, load_animation
from .appearance.light import Environment, PointLight
from .appearance.material import Material
from .appearance.texture import Texture
from .camera import Camera
from .choices import Choice, Choices
from .errors import (
    ContextError, Error, LimitError, MethodError, OptionError, SceneError, SettingsError,
    ShaderError
)
from .hits import Hits
from .methods import Method, load_methods, methods
from .scene import Scene, load_scene
from .surfaces.deformation import Deformation
from .surfaces.geometry_image import GeometryImage
from .surfaces.parametrise import remesh
from .tracer import Tracer

__all__ = [
    "Animation", "Camera", "Choice", "Choices", "ContextError", "Deformation", "Environment",
    "Error", "GeometryImage", "Hits", "LimitError", "Material", "Method", "MethodError",
    "OptionError", "PointLight", "Scene", "SceneError", "SettingsError", "ShaderError",
    "Texture", "Tracer", "load_animation", "load_methods", "load_scene", "methods", "reference",
    "remesh"]
