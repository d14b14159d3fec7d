"""The records of pictures: what programs read of surfaces and lights, and what a pixel gathers."""
from __future__ import annotations

from ..gl.record import Record

SURFACE = Record("surface", "normal:vec3 material:int")
"""What shading always needs of a triangle: unit normal; and the row of its material."""

COLOUR = Record("colour", "diffuse:vec3")
"""A triangle's diffuse share, where they differ."""

CORNER_NORMALS = Record("corner_normals", "n0:vec3 | n1:vec3 | n2:vec3")
"""Normals of a triangle's corners, zeros where it is flat."""

CORNER_UV = Record("corner_uv", "uv0:vec2 uv1:vec2 | uv2:vec2")
"""Texture coordinates of a triangle's corners."""

MIRROR = Record("mirror", "share:vec3")
"""The share of light that a material reflects as a mirror."""

DIELECTRIC = Record("dielectric", "ior")
"""The refractive index of a material; 0 where light does not pass through it."""

GLOSSY = Record("glossy", "share:vec3 exponent")
"""The share of light that a material reflects into a lobe, and the lobe's cosine exponent."""

EMISSION = Record("emission", "radiance:vec3")
"""The radiance that a material emits."""

LIGHT_CHOICE = Record("light_choice", "light:int alias:int keep")
"""What a random number chooses: a light, the row of a triangle or -1 - k for the k-th point (the
surroundings count as one after the last), kept with this probability; and which one else."""

POINT_LIGHT = Record("point_light", "position:vec3 | strength:vec3")
"""A point light that paths ask: the irradiance it gives, over the chance that it is chosen."""

SURROUNDINGS_ROW = Record("surroundings_row", "sum cosine")
"""A row of cells of the image that surrounds a scene: how likely it and those above are asked;
the mean of its latitude's cosine."""

IMAGE = Record("image", "x:int y:int width:int height:int")
"""The rectangle of a material's image in the texture of all images; width 0 for no image."""

LIT = Record("lit", "ambient:vec3")
"""Light that leaves a hit towards the eye whatever casts shadows."""

DIRECT = Record("direct", "light:vec3")
"""Light that does unless a shadow takes it away."""

RADIANCE = Record("radiance", "sum:vec3")
"""What a pixel has gathered so far."""

SCREEN = Record("screen", "colour:vec4")
"""A pixel as it is shown, sRGB."""

LIVE = Record("live", "weight")
"""The largest weight of a path in a tile of pixels."""

PATH = Record("path", "weight:vec3")
"""How much of what a ray meets arrives at its pixel."""

WALK = Record("walk", "weight:vec3 density")
"""Of a path: how much of what it meets arrives at its pixel, zero where it has ended; how likely
its ray's direction was, 0 where that was certain."""

CAME_FROM = Record("came_from", "x:int y:int")
"""The texel in the wave that a packed path came from."""

SUMS = Record("sums", "total:vec4 | lost:vec4")
"""Of a pixel: radiance, and squared luminance, summed over its paths; what that rounded off."""
