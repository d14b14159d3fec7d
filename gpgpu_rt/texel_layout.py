"""THE declaration of every record (of states of rays: state_layout.py): which field stands in
which texel and channel.

From one declaration come the numpy packer and the GLSL accessors (see ``record.py``). A record is
one of two things:

* a **table** record: many records in one texture, a record's texels side by side. GLSL reads
  ``kd_node_split(i)``;
* a **stream** record: one record a ray, a texture for each texel. GLSL gets a struct, and
  ``state_load(pixel)`` and ``state_store(state)`` that read and write it whole.
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .record import EXACT_INTEGER, PackedRecord, Record

# Tables ------------------------------------------------------------------------------------------

TRIANGLE = Record("triangle", "v0:vec3 index:int | v1:vec3 last:int | v2:vec3")
"""A triangle; ``index`` its row in the scene, ``last`` 1 where a leaf's run of triangles ends."""

REFERENCE = Record("reference", "triangle:int")
"""An entry of a leaf's or a cell's list: the row of a triangle, or -1, the sentinel."""

GRID_CELL = Record("grid_cell", "first:int")
"""A cell: its first reference, or minus the cells to the nearest occupied one if it is empty (-1
says no more than that it is)."""

KD_NODE = Record("kd_node", "split axis:int left:int count:int")
"""A node: plane; axis, or 3 plus a leaf's number; left child (the right one follows) or first
reference; references of a leaf, or which children are leaves without: 1 the left, 2 the right."""

KD_BOUNDS = Record("kd_bounds", "lo:vec3 parent:int | hi:vec3")
"""What kd-backtrack adds to a node: its box and its parent."""

KD_LEAF = Record("kd_leaf", "lo:vec3 rope_lo_x:int | hi:vec3 rope_hi_x:int "
                            "| rope_lo_y:int rope_hi_y:int rope_lo_z:int rope_hi_z:int")
"""What kd-ropes adds to a leaf, by its number: its box, and the node behind each face or -1."""

BVH_NODE = Record("bvh_node", "lo:vec3 escape:int | hi:vec3 first:int")
"""A threaded node: box, escape index (-1 ends), first triangle of a leaf or -1.

Octant copies have the corner a ray meets first in ``lo``, unless they share subtrees: a portal's
``first`` is -2 less the node below, from where an escape index of -1 leads to behind it.
"""

BIH_NODE = Record("bih_node", "left_hi right_lo axis:int child:int")
"""A node of intervals: where its left child ends and its right one begins, axis (3 for a leaf),
left child (the right one follows) or a leaf's first triangle."""

BIH_BOUNDS = Record("bih_bounds", "lo:vec3 parent:int | hi:vec3 side:int")
"""What climbing adds to such a node: its box, its parent, and which child it is: of the parent's
axis, 3 more if the right one, 6 for the root."""

BVH_PAIR = Record("bvh_pair", "left_lo:vec3 left:int | left_hi:vec3 | right_lo:vec3 right:int "
                              "| right_hi:vec3")
"""An inner node with its children's boxes; a child is an inner node, or -1 minus the first
triangle of a leaf."""

_LINK = "target:29 portal:1 last:1 leaf:1"
QUANTISED_NODE_16 = PackedRecord(
    "quantised_node", "lo_x:16 hi_x:16 | lo_y:16 hi_y:16 | lo_z:16 hi_z:16 | " + _LINK)
QUANTISED_NODE_8 = PackedRecord(
    "quantised_node", "lo_x:8 hi_x:8 lo_y:8 hi_y:8 | lo_z:8 hi_z:8 | " + _LINK)
"""A threaded node in one integer texel: bounds in steps of the scene's box, rounded outward;
``target`` is a leaf's first triangle, a portal's first shared node (of both the escape index is
the next node) or an inner node's escape index; ``last`` marks a node with none."""

_LINKS = "left:31 left_leaf:1 | right:31 right_leaf:1"
QUANTISED_PAIR_16 = PackedRecord(
    "quantised_pair", "left_lo_x:16 left_hi_x:16 | left_lo_y:16 left_hi_y:16 "
                      "| left_lo_z:16 left_hi_z:16 | right_lo_x:16 right_hi_x:16 "
                      "| right_lo_y:16 right_hi_y:16 | right_lo_z:16 right_hi_z:16 | " + _LINKS)
QUANTISED_PAIR_8 = PackedRecord(
    "quantised_pair", "left_lo_x:8 left_hi_x:8 left_lo_y:8 left_hi_y:8 "
                      "| right_lo_x:8 right_hi_x:8 right_lo_y:8 right_hi_y:8 "
                      "| left_lo_z:8 left_hi_z:8 right_lo_z:8 right_hi_z:8 | " + _LINKS)
"""An inner node with its children's boxes in steps of the scene's box, rounded outward; a child is
an inner node, or a leaf's first triangle."""

RAY_BOX = Record("ray_box", "first:int")
"""A five-dimensional box of rays: the first of its candidates."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit, -1 behind the last; where it begins along their dominant
axis, counted the way they go."""

BEAM = Record("beam", "first:int entries:int")
"""Rays of a cell of directions through a tile: the run of what they may cross."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam, by where it begins along the beam's axis; where it ends, and where the
last one of those up to it does."""

POSITION = Record("position", "at:vec3")
"""A texel of a geometry image: the surface's position there."""

IMAGE_CELL = Record("image_cell", "corner:int across:int down:int face:int")
"""A quad of a geometry image: the texel of its first corner; how far on the texels beside and
below that one lie, each negative where a triangle has no area (across: the upper one, down: the
lower); the first of its two faces."""

MIN_PYRAMID = Record("min_pyramid", "lo:vec3 miss:int")
"""A node of a geometry image's quadtrees: lower corner; the node after its subtree, or -1."""

MAX_PYRAMID = Record("max_pyramid", "hi:vec3 hit:int")
"""The same node's upper corner, and its first child, or -1 minus the cell of a leaf."""

PYRAMID_LINK = Record("pyramid_link", "miss:int hit:int")
"""Both links of a node for rays of one octant of directions, octant after octant."""

PYRAMID_SOURCE = Record("pyramid_source", "first:int last:int")
"""What a node's box is made from: its first and last child. Of a node on the finest level: the
first and last texel of its cell, which are diagonal corners."""

SURFACE = Record("surface", "normal:vec3 material:int")
"""What shading always needs of a triangle: unit normal; and the row of its material."""

COLOUR = Record("colour", "diffuse:vec3")
"""A triangle's diffuse share, where they differ."""

CORNER_NORMALS = Record("corner_normals", "n0:vec3 | n1:vec3 | n2:vec3")
"""Normals of a triangle's corners, zeros where it is flat."""

CORNER_UV = Record("corner_uv", "uv0:vec2 uv1:vec2 | uv2:vec2")
"""Texture coordinates of a triangle's corners."""

MIRROR = Record("mirror", "share:vec3")
"""Of a material: what it reflects as a mirror."""

DIELECTRIC = Record("dielectric", "ior")
"""Of a material: its refractive index, 0 for one that lets nothing through."""

GLOSSY = Record("glossy", "share:vec3 exponent")
"""Of a material: what it reflects into a lobe, and the cosine's exponent in that."""

EMISSION = Record("emission", "radiance:vec3")
"""Of a material: what it sends out by itself."""

LIGHT_CHOICE = Record("light_choice", "light:int alias:int keep")
"""What a random number chooses: a light, the row of a triangle or -1 - k for the k-th point (the
surroundings count as one after the last), kept with this probability; and which one else."""

POINT_LIGHT = Record("point_light", "position:vec3 | strength:vec3")
"""A point light that paths ask: the irradiance it gives, over the chance that it is chosen."""

SURROUNDINGS_ROW = Record("surroundings_row", "sum cosine")
"""A row of cells of the image that surrounds a scene: how likely it and those above are asked;
the mean of its latitude's cosine."""

IMAGE = Record("image", "x:int y:int width:int height:int")
"""Of a material: where its image lies in the texture of all images; width 0 for none."""

# Streams -----------------------------------------------------------------------------------------

RAY_TEXELS = Record("rays", "origin:vec3 t_min | direction:vec3 t_max")
"""A ray as it lies in its two textures."""

RAY_AFTER_HIT = replace(RAY_TEXELS, layout=RAY_TEXELS.layout + " | after:int",
                        define="AFTER_HIT")
"""A ray that goes on behind what it hit at t_min: of the triangles at just that t only those above
``after`` count, which is -1 where nothing was hit yet."""

NO_RAY = RAY_AFTER_HIT.pack(origin=np.zeros((1, 3)), t_min=[1], direction=[[0, 0, 1]], t_max=[-1],
                            after=[-1])[0]
"""(3, 4) float32, what texels hold that no ray lies in: one whose interval is empty."""

NO_TRIANGLE = EXACT_INTEGER     # above every index: the lowest of several is one, if there is one
HIT = Record("hit", "t u v triangle:int", constants=(("NO_TRIANGLE", NO_TRIANGLE),))
"""The nearest hit so far; of none NO_TRIANGLE and the ray's end; what packets miss has any end."""

COUNTERS = Record("counters", "nodes_visited:int leaves_visited:int triangles_tested:int")
"""What a ray did; exists only in programs with statistics."""

STACK_ENTRY = Record("stack_entry", "t_max node:int")
"""A level of a ray's stack in an atlas: a node to visit, and where the interval in it ends."""

NEAREST = Record("nearest", "t")
"""Of a ray: the least t of the triangles drawn over it."""

FOUND = Record("found", "triangle:int")
"""Of a ray: the lowest of the triangles drawn over it at that t."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box that a ray lies in; behind the boxes, its face; or -1, a miss."""

DEPTH_BOUNDS = Record("depth_bounds", "least closed minus_most")
"""Of a tile of eye rays: between which depths along the view triangles lie, the greatest negated
so that one blending takes the minimum of all; and the depth at which a triangle closes it."""

LIT = Record("lit", "ambient:vec3")
"""Light that leaves a hit towards the eye whatever casts shadows."""

DIRECT = Record("direct", "light:vec3")
"""Light that does unless a shadow takes it away."""

RADIANCE = Record("radiance", "sum:vec3")
"""What a pixel has gathered so far."""

SCREEN = Record("screen", "colour:vec4")
"""A pixel as it is shown, sRGB."""

LIVE = Record("live", "weight")
"""Of a tile of pixels: the largest weight of a path in it."""

PATH = Record("path", "weight:vec3")
"""How much of what a ray meets arrives at its pixel."""

WALK = Record("walk", "weight:vec3 density")
"""Of a path: how much of what it meets arrives at its pixel, zero where it has ended; how likely
its ray's direction was, 0 where that was certain."""

CAME_FROM = Record("came_from", "x:int y:int")
"""Of a path that is packed: its texel in the wave."""

SUMS = Record("sums", "total:vec4 | lost:vec4")
"""Of a pixel: radiance, and squared luminance, summed over its paths; what that rounded off."""

SHOWN = Record("shown", "depth triangle:int")
"""What a rasterised pixel shows: a depth that its hit does not lie behind, and the triangle."""

SHOWN_FOUR = Record("shown_four", "triangle:ivec4 | depth:vec4")
"""Four such pixels of a row."""

SHOWN_BLOCK = Record("shown_block", "depth lowest:int highest:int")
"""A square of such pixels: the greatest depth, the lowest and the highest triangle."""

PART = Record("part", "row:int x:int y:int")
"""A triangle in a part of the image, which begins at a pixel."""

VERDICT = Record("verdict", "kind:int first:int last:int")
"""What becomes of such a triangle, as in common/verdict.glsl; where it must be cut up, the parts
it begins and ends in, counted across and then in rows of 1,024."""

TILE_BEAM = Record(
    "tile_beam", "lo_origin:vec3 t_min | hi_origin:vec3 t_max | inv_lo:vec3 signs:int "
                 "| inv_hi:vec3 live:int")
"""The rays of a tile by their outermost values: what corners are measured from, t and inverse
direction; which signs directions have by axis (bit a negative, 3 + a positive), and how
many rays are not empty."""

ENTRIES = 28      # of a tile, at most
ENTRY_TILE = 4    # rays a side of the tiles that rays have their lists from
ENTRY_POINTS = Record("entries", " | ".join(f"list_{k}:ivec4" for k in range(ENTRIES // 4))
                      + " | visited:int count:int")
"""Where a tile's rays enter the tree, see common/entry_list.glsl; nodes that its beam visited, and
how many entries there are."""

ENTRY_LIST = Record("entry_list", "codes:ivec4")
"""Four entries of a tile's list."""

PACKET_ENTRY = Record(
    "packet_entry", "start:int link_1:int link_2:int link_3:int | inv_lo:vec3 link_4:int "
                    "| inv_hi:vec3 t_min | lo_origin:vec3 visited:int | hi_origin:vec3 met:int",
    constants=(("NO_LINK", EXACT_INTEGER),))
"""Where packets of a tile enter the tree if their rays lie within the beam of these outermost
values (common/packet_entry.glsl), NO_LINK for nowhere; how many nodes the beam visited, and 0
where it holds all rays of the tile and meets nothing."""

TILE_BOUNDS = Record("tile_bounds", "least:vec3 live:int | most:vec3")
"""Directions of a tile's rays by their outermost components; 0 where no ray is live."""

TILE_SPAN = Record("tile_span", "centre:vec3 live:int | axis:vec3")
"""Where the rays of a tile begin and go: the middle of their origins, how many rays are not empty,
and the middle of their directions."""

TILE_CONE = Record("tile_cone", "apex:vec3 radius | axis:vec3 cosine")
"""A cone around the rays of a tile: around every origin within ``radius`` of the apex, directions
whose angle to the axis has this cosine at least."""

TILE_END = Record("tile_end", "reach lines:int")
"""How far from their origins the rays of a tile still search, world units, -1 for no ray that
does; and 1 where one of them also searches behind its origin."""

QUADS = Record("quads", "drawn:int tested:int")
"""Quads of triangles that were drawn over a ray, and triangles tested in them."""

# Streams of construction -------------------------------------------------------------------------

VALUES = Record("values", "value:vec4")
"""Four numbers an element: what is reduced, scanned or flagged."""

SORT_KEY = Record("sort_key", "hi:int lo:int index:int")
"""A key of two numbers, up to 24 bits each, and what it belongs to; sorted in this order."""

SOURCE = Record("source", "index:int")
"""The element that one is taken from."""

BOX = Record("box", "lo:vec3 | hi:vec3")
"""A box: of a triangle, of a run of slots or of a node."""

BIN = Record("bin", "lo:vec3 count:int | minus_hi:vec3")
"""What the triangles in a bin span, the upper corner negated so that one blending takes the
minimum of both, and how many they are."""

SLOT = Record("slot", "triangle:int node:int starts:int")
"""A place in the order: its triangle; the node being split there, or -1; 1 where a leaf begins."""

SPLIT = Record("split", "axis:int at:int taken:int")
"""How a node is split: ``taken`` triangles go left, none where it is a leaf; which ones, says a
bin, or a slot, along an axis; 3 stands for the order of slots itself."""

INTERVAL = Record("interval", "first:int last:int parent:int turns:int")
"""A node as the slots that it spans, or -1 for none; an ancestor, or -1 for none; and of those on
the way there how many have it on their left."""

# Streams of Zhou's kd-tree build -----------------------------------------------------------------

PIECE = Record("piece", "lo:vec3 triangle:int | hi:vec3 node:int")
"""The part of a triangle in a node: its box; the node's number in its level, or a small root's."""

CELL = Record("cell", "lo:vec3 count:int | hi:vec3 futile:int | parent:int")
"""A node of a level of large nodes: its box, its pieces; how many levels have told none from
another, or the prefix of codes that it is; its parent in the level above."""

CHUNK = Record("chunk", "lo:vec3 | hi:vec3 | left:vec3 | right:vec3")
"""Some pieces of a node: bounds; how many lie left and right of the node's middle, by axis."""

DECISION = Record("decision", "plane axis:int futile:int")
"""How a node of such a level is split; axis 3: not at all."""

TALLIES = Record("tallies", "left_x:vec4 | left_y:vec4 | left_z:vec4 | right_x:vec4 "
                            "| right_y:vec4 | right_z:vec4")
"""How many of some pieces lie left and right of four planes along each axis."""

OFFER = Record("offer", "plane axis:int cost")
"""The cheapest of some planes of a node; axis 3: none."""

SMALL_NODE = Record("node", "lo:vec3 base:int | hi:vec3 levels:int | mask:vec4")
"""A small node: its box, its root's first piece, how many levels there may be below it, and which
of the root's pieces it holds: 64 bits, 16 a channel."""

EXTENT = Record("extent", "lo hi")
"""A piece along one axis."""

SIDES = Record("sides", "lower_left:vec4 | lower_right:vec4 | upper_left:vec4 | upper_right:vec4")
"""Which pieces of a root lie left and right of where a piece begins and of where it ends, along
one axis: masks as a small node's."""

CHOICE = Record("choice", "plane face:int source:int inner:int")
"""The cheapest plane of a small node: a box's face, 0 to 5; its extent; whether it is taken."""

PLACE = Record("place", "at:int pair:int")
"""Where a node stands in depth-first order, and where the pair of its children does."""

BUILT = Record("built", "split axis:int left:int count:int | mask:vec4 | base:int")
"""A node of the finished tree, and where a leaf's pieces are: from base on those of the mask, or
where that is empty the first ones."""

# Ray streams -------------------------------------------------------------------------------------

QUEUED = Record("queued", "child:int x:int y:int t_enter")
"""A ray, by its texel, and a node that it is in, as children of BVH_PAIR; where it enters it."""

VISITED = Record("visited", "near:int near_t far:int far_t | x:int y:int")
"""What a ray finds at a node: the children that it is in and where it enters them; its texel."""

MET = Record("met", "u v tests:int")
"""More of a TESTED leaf: where on the nearest triangle, and how many were tested."""

TALLY = Record("tally", COUNTERS.layout)
"""By blending, what a ray did so far."""

# Streams of the ray hierarchy --------------------------------------------------------------------

CONE = Record("cone", "centre:vec3 radius | axis:vec3 chord | reach")
"""A node over rays: a sphere around their origins, all lengths in units of about the scene's size;
an axis and how far unit directions lie from it at most; how far the rays go, or -1 where none is
left."""

PAIR = Record("pair", "triangle:int x:int y:int")
"""A triangle and a node of a level of the hierarchy; triangle -1 where the slot is empty."""

CHILDREN = Record("children", "first:ivec3 | second:ivec3 | third:ivec3 | fourth:ivec3")
"""What became of a pair: the triangle with each of the node's children, as a PAIR."""

TESTED = Record("tested", "t triangle:int x:int y:int")
"""A ray's test of a triangle: t and the triangle, or infinity and -1; the ray's texel."""

LEAST = Record("least", "t spare:vec2 tests:int")
"""By blending, the least t of a ray's tests and how many they were."""

LOWEST = Record("lowest", "triangle:int")
"""By blending, the lowest triangle of those at the least t."""

VISITS = Record("visits", "count:int")
"""How often a node was met with a triangle."""

# Ray bundles -------------------------------------------------------------------------------------

LAYER = Record("layer", "depth slope:vec2 side:int")
"""What a parallel projection shows at a pixel, one layer of all: depth at the pixel's centre and
how it grows from there, a pixel to the right and one up; the side of a triangle that faces the
viewer, twice its row, plus one where that is its back, or -1 for nothing."""

LEAVING = Record("leaving", "radiance:vec3")
"""Of a side of a triangle: what leaves it, the same everywhere on it and in every direction."""
