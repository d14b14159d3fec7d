"""The records of pictures: of surfaces and lights, of rays and paths, and of a pixel's light."""
from __future__ import annotations

from ..gl.record import Record

SURFACE = Record("surface", "normal:vec3 material:int")
"""The unit normal of a triangle, and the row of its material."""

COLOUR = Record("colour", "diffuse:vec3")
"""The diffuse share of a triangle, if triangles have different shares."""

CORNER_NORMALS = Record("corner_normals", "n0:vec3 | n1:vec3 | n2:vec3")
"""The normals of a triangle's corners; zeros for a flat triangle."""

CORNER_UV = Record("corner_uv", "uv0:vec2 uv1:vec2 | uv2:vec2")
"""The texture coordinates of a triangle's corners."""

MIRROR = Record("mirror", "share:vec3")
"""The share of light that a material reflects as a mirror."""

DIELECTRIC = Record("dielectric", "ior")
"""The refractive index of a material; 0 if no light passes through the material."""

GLOSSY = Record("glossy", "share:vec3 exponent")
"""The share of light that a material reflects into a lobe, and the lobe's cosine exponent."""

EMISSION = Record("emission", "radiance:vec3")
"""The radiance that a material emits."""

LIGHT_CHOICE = Record("light_choice", "light:int alias:int keep")
"""An entry of the alias table of lights (``scene/light_choice.py``): a light, its alias, and the
probability ``keep`` of choosing the light instead of the alias. A light is the row of a triangle,
or -1 - k for point light k. The surroundings count as the point light after the last."""

POINT_LIGHT = Record("point_light", "position:vec3 | strength:vec3")
"""A point light that paths sample. ``strength`` is the irradiance of a surface that faces the
light, at any distance, divided by the probability of choosing this light."""

SURROUNDINGS_ROW = Record("surroundings_row", "sum cosine")
"""A row of cells of the image that surrounds a scene (``scene/image_light.py``). ``sum`` is the
cumulative probability up to this row, and ``cosine`` is the row's mean cosine of latitude."""

IMAGE = Record("image", "x:int y:int width:int height:int")
"""The rectangle of a material's image in the texture of all images. Width 0 means no image."""

LIT = Record("lit", "ambient:vec3")
"""The light that leaves a hit towards the eye, even if the hit is in shadow."""

DIRECT = Record("direct", "light:vec3")
"""The light that leaves a hit towards the eye only if the hit is not in shadow."""

RADIANCE = Record("radiance", "sum:vec3")
"""The light that a pixel has gathered so far."""

SCREEN = Record("screen", "colour:vec4")
"""The final colour of a pixel: sRGB, or linear light that the host converts (``tone_map.py``)."""

LIVE = Record("live", "weight")
"""The largest weight of the rays in a tile of pixels."""

PATH = Record("path", "weight:vec3")
"""A ray's weight: its pixel receives the light that the ray finds, multiplied by ``weight``."""

WALK = Record("walk", "weight:vec3 density")
"""The state of a path. Its pixel receives the light that the path finds, multiplied by ``weight``.
``weight`` is zero after the path's end. ``density`` is the probability density of the ray's
direction; 0 if only this direction was possible."""

CAME_FROM = Record("came_from", "x:int y:int")
"""The texel of the wave's textures from which a packed path came (glsl/render/bring_back.vert)."""

SUMS = Record("sums", "total:vec4 | lost:vec4")
"""``total`` is a pixel's radiance and squared luminance, summed over its paths. ``lost`` is the
rounding error of this sum, for compensated summation."""
