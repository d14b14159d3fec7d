"""The records of pictures: surfaces and lights, which shaders read, and the results of pixels."""
from __future__ import annotations

from ..gl.record import Record

SURFACE = Record("surface", "normal:vec3 material:int")
"""The unit normal of a triangle, and the row of its material; shading always needs both."""

COLOUR = Record("colour", "diffuse:vec3")
"""The diffuse share of a triangle; used if the triangles' shares differ."""

CORNER_NORMALS = Record("corner_normals", "n0:vec3 | n1:vec3 | n2:vec3")
"""The normals of a triangle's corners; zeros for a flat triangle."""

CORNER_UV = Record("corner_uv", "uv0:vec2 uv1:vec2 | uv2:vec2")
"""The texture coordinates of a triangle's corners."""

MIRROR = Record("mirror", "share:vec3")
"""The share of light that a material reflects as a mirror."""

DIELECTRIC = Record("dielectric", "ior")
"""The refractive index of a material; 0 where light does not pass through it."""

GLOSSY = Record("glossy", "share:vec3 exponent")
"""The share of light that a material reflects into a lobe, and the lobe's cosine exponent."""

EMISSION = Record("emission", "radiance:vec3")
"""The radiance that a material emits."""

LIGHT_CHOICE = Record("light_choice", "light:int alias:int keep")
"""An entry of the alias table of lights: a light, its alias, and the probability ``keep`` of the
light over the alias. A light is the row of a triangle, or -1 - k for point light k; the
surroundings come after the last point light."""

POINT_LIGHT = Record("point_light", "position:vec3 | strength:vec3")
"""A point light that paths sample: its position, and its irradiance over the probability that it
is chosen."""

SURROUNDINGS_ROW = Record("surroundings_row", "sum cosine")
"""A row of cells of the image that surrounds a scene: the cumulative probability of the rows up to
this one, and the mean cosine of the row's latitude."""

IMAGE = Record("image", "x:int y:int width:int height:int")
"""The rectangle of a material's image in the texture of all images; width 0 for no image."""

LIT = Record("lit", "ambient:vec3")
"""The light that leaves a hit towards the eye and does not depend on shadows."""

DIRECT = Record("direct", "light:vec3")
"""The light that leaves a hit towards the eye unless the hit is in shadow."""

RADIANCE = Record("radiance", "sum:vec3")
"""The light that a pixel has gathered so far."""

SCREEN = Record("screen", "colour:vec4")
"""The final colour of a pixel, sRGB."""

LIVE = Record("live", "weight")
"""The largest weight of a path in a tile of pixels."""

PATH = Record("path", "weight:vec3")
"""The weight of a ray: the share of the light it finds that arrives at its pixel."""

WALK = Record("walk", "weight:vec3 density")
"""The state of a path: its weight, the share of the light it finds that arrives at its pixel, zero
after its end; and the probability density of its ray's direction, 0 if only this direction was
possible."""

CAME_FROM = Record("came_from", "x:int y:int")
"""The texel in the wave that a packed path came from."""

SUMS = Record("sums", "total:vec4 | lost:vec4")
"""The radiance and the squared luminance of a pixel, summed over its paths; ``lost`` is the
rounding error of the sums, for compensated summation."""
