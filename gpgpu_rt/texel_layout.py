"""THE declaration of every record: which field stands in which texel and channel.

From one declaration come the numpy packer and the GLSL accessors. A record is one of two things:

* a **table** record: many records in one texture, a record's texels side by side. GLSL reads
  ``kd_node_split(i)``;
* a **stream** record: one record a ray, a texture for each texel. GLSL gets a struct, and
  ``state_load(pixel)`` and ``state_store(state)`` that read and write it whole.

A declaration reads like the texels: ``"v0:vec3 index:int | v1:vec3 last:int | v2:vec3"``.
Types are float (the default), vec2, vec3, vec4, int, ivec3 and ivec4. Integers are stored as float
values, exact up to 2^24 either side of zero, and packing raises where one is past that.

Fields that are no integers are geometric: they follow the option ``storage``. Under fp16 they move
to texels of their own, in half float textures, and integers keep their float32 ones.
"""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from .errors import LimitError

TABLE_WIDTH_LOG2 = 12     # tables are 4096 texels wide: shifts and masks, no division
EXACT_INTEGER = 1 << 24   # float32 holds every integer up to here
_WIDTHS = {"float": 1, "int": 1, "vec2": 2, "vec3": 3, "vec4": 4, "ivec3": 3,
           "ivec4": 4}


@dataclass(frozen=True)
class Field:
    """A field of a record: its GLSL type and where it stands."""

    name: str
    type: str
    texel: int
    channel: int

    @property
    def width(self) -> int:
        return _WIDTHS[self.type]

    @property
    def swizzle(self) -> str:
        return "xyzw"[self.channel:self.channel + self.width]

    @property
    def is_integer(self) -> bool:
        return self.type in ("int", "ivec3", "ivec4")

    def decode(self, texel: str) -> str:
        """GLSL that reads the field from a texel."""
        value = f"{texel}.{self.swizzle}"
        return f"{self.type}({value})" if self.is_integer else value

    def encode(self, value: str) -> str:
        """GLSL that turns the field's value into what its channels hold."""
        floats = {"int": "float", "ivec3": "vec3", "ivec4": "vec4"}
        return f"{floats[self.type]}({value})" if self.is_integer else value


@dataclass(frozen=True)
class Plane:
    """Texels of a record that lie in textures of one type.

    ``suffix`` tells a table's textures apart; ``components`` is 1, 2 or 4 (three-channel targets
    are not portable); ``dtype`` is f4 or f2.
    """

    suffix: str
    first: int
    texels: int
    components: int
    dtype: str


@dataclass(frozen=True)
class Record:
    """A record named ``name`` (GLSL prefix) whose texels are declared in ``layout``.

    ``half_texels`` of them, the first ones, lie in half float textures; ``storage`` is the format
    that geometric fields are rounded to. Both come from ``stored``. ``uniform_texels`` of a stream
    are the same for all its records: a program reads them from uniforms, not from textures.
    """

    name: str
    layout: str
    storage: str = "fp32"
    half_texels: int = 0
    uniform_texels: tuple[int, ...] = ()

    @lru_cache(maxsize=None)
    def stored(self, storage: str) -> Record:
        """This record under the option ``storage``; under fp16 regrouped, geometric first."""
        if storage != "fp16":
            return Record(self.name, self.layout, storage)
        groups = [_cut_into_texels(f for f in self.fields if f.is_integer is integer)
                  for integer in (False, True)]
        return Record(self.name, " | ".join(groups[0] + groups[1]), storage, len(groups[0]))

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        found = []
        for texel, texel_fields in enumerate(self.layout.split("|")):
            channel = 0
            for word in texel_fields.split():
                name, _, kind = word.partition(":")
                field = Field(name, kind or "float", texel, channel)
                channel += field.width
                if channel > 4:
                    raise ValueError(f"record {self.name}: texel {texel} has over four channels")
                found.append(field)
        return tuple(found)

    @property
    def texels(self) -> int:
        """Texels a record takes."""
        return self.layout.count("|") + 1

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """The types of texture that the record's texels lie in."""
        half = self.half_texels
        parts = (("_half", 0, half, "f2"), ("", half, self.texels - half, "f4"))
        planes = []
        for suffix, first, texels, dtype in parts:
            used = max((f.channel + f.width for f in self.fields
                        if first <= f.texel < first + texels), default=0)
            if used:
                planes.append(Plane(suffix, first, texels, 4 if used == 3 else used, dtype))
        return tuple(planes)

    def plane_of(self, texel: int) -> Plane:
        return next(p for p in self.planes if p.first <= texel < p.first + p.texels)

    def pack(self, **arrays: np.ndarray) -> np.ndarray:
        """Records from one array a field.

        Parameters
        ----------
        arrays : (n,) or (n, width) each, by field name; a field left out is zero

        Returns
        -------
        (n, texels, 4) float32

        Raises
        ------
        LimitError
            where an int field is past 2^24, or there are more records than floats can index.
        """
        unknown = set(arrays) - {f.name for f in self.fields}
        if unknown:
            raise ValueError(f"record {self.name} has no field {', '.join(sorted(unknown))}")
        count = len(next(iter(arrays.values())))
        check_count(self.name, count)
        packed = np.zeros((count, self.texels, 4), np.float32)
        for field in self.fields:
            if field.name not in arrays:
                continue
            values = np.asarray(arrays[field.name])
            if field.is_integer and count and np.abs(values).max() > EXACT_INTEGER:
                raise LimitError(f"{self.name}.{field.name} is past 2^24, the last integer a "
                                 "float texel holds exactly; take a smaller scene")
            packed[:, field.texel, field.channel:field.channel + field.width] = (
                values.reshape(count, field.width))
        return packed

    def unpack(self, texels: np.ndarray) -> dict[str, np.ndarray]:
        """The inverse of ``pack``: (n, texels, 4) -> arrays by field name."""
        fields = {}
        for f in self.fields:
            values = texels[:, f.texel, f.channel:f.channel + f.width]
            values = values[:, 0] if f.width == 1 else values
            fields[f.name] = values.astype(np.int32) if f.is_integer else values
        return fields

    def table_glsl(self) -> str:
        """Accessors of a table record: ``kd_node_split(i)`` and one a field."""
        lines = [f"uniform sampler2D {self.name}{plane.suffix}_table;" for plane in self.planes]
        for f in self.fields:
            plane = self.plane_of(f.texel)
            fetch = (f"texelFetch({self.name}{plane.suffix}_table, "
                     f"table_texel(i * {plane.texels} + {f.texel - plane.first}), 0)")
            lines.append(f"{f.type} {self.name}_{f.name}(int i) {{ return {f.decode(fetch)}; }}")
        return "\n".join(lines)

    def stream_glsl(self, writes: bool, first_target: int = 0) -> str:
        """Struct and load of a stream record; with ``writes``, rounding to its storage and store.

        ``first_target`` is the render target of the record's first texel.
        """
        name, struct = self.name, self.name.capitalize()
        lines = [f"struct {struct} {{"]
        lines += [f"    {f.type} {f.name};" for f in self.fields] + ["};"]
        kinds = ["vec4" if k in self.uniform_texels else "sampler2D" for k in range(self.texels)]
        lines += [f"uniform {kind} {name}_texel_{k};" for k, kind in enumerate(kinds)]
        lines += [f"{struct} {name}_load(ivec2 pixel) {{", f"    {struct} record;"]
        for k, kind in enumerate(kinds):
            value = f"{name}_texel_{k}"
            value = value if kind == "vec4" else f"texelFetch({value}, pixel, 0)"
            lines.append(f"    vec4 texel_{k} = {value};")
        for f in self.fields:
            lines.append(f"    record.{f.name} = {f.decode(f'texel_{f.texel}')};")
        lines += ["    return record;", "}"]
        if writes:
            lines += [f"{struct} {name}_stored({struct} record) {{"]
            if self.storage != "fp32":
                lines += [f"    record.{f.name} = stored(record.{f.name});"
                          for f in self.fields if not f.is_integer]
            lines += ["    return record;", "}"]
            for k in range(self.texels):
                lines.append(f"layout(location = {first_target + k}) out vec4 {name}_target_{k};")
            lines += [f"void {name}_store({struct} record) {{",
                      f"    record = {name}_stored(record);"]
            for k in range(self.texels):
                lines.append(f"    {name}_target_{k} = vec4(0.0);")
            for f in self.fields:
                value = f.encode(f"record.{f.name}")
                lines.append(f"    {name}_target_{f.texel}.{f.swizzle} = {value};")
            lines.append("}")
        return "\n".join(lines)


@dataclass(frozen=True)
class PackedRecord:
    """A table record of bit fields in integer texels, four channels each.

    ``"lo:16 hi:16 | link:32"`` reads from the lowest bit of each channel up. GLSL reads
    ``name_lo(i)``, a uint.
    """

    name: str
    layout: str

    @cached_property
    def fields(self) -> tuple[tuple[str, int, int, int], ...]:
        """Name, channel, lowest bit and number of bits of each field."""
        found = []
        for channel, word in enumerate(self.layout.split("|")):
            shift = 0
            for field in word.split():
                name, _, bits = field.partition(":")
                found.append((name, channel, shift, int(bits)))
                shift += int(bits)
            if shift > 32:
                raise ValueError(f"record {self.name}: channel {channel} has over 32 bits")
        return tuple(found)

    @property
    def channels(self) -> int:
        used = self.layout.count("|") + 1
        return used if used < 4 else 4 * self.texels

    @property
    def texels(self) -> int:
        """Texels a record takes."""
        return (self.layout.count("|") + 4) // 4

    def pack(self, **arrays: np.ndarray) -> np.ndarray:
        """(n, texels, channels of one) uint32 from one (n,) array a field; LimitError where one
        does not fit."""
        packed = np.zeros((len(next(iter(arrays.values()))), self.channels), np.uint32)
        for name, channel, shift, bits in self.fields:
            values = np.asarray(arrays[name]).astype(np.int64)
            if len(values) and (values.min() < 0 or values.max() >= 1 << bits):
                raise LimitError(f"{self.name}.{name} does not fit its {bits} bits; take a "
                                 "smaller scene, or no quantised nodes")
            packed[:, channel] |= (values << shift).astype(np.uint32)
        return packed.reshape(len(packed), self.texels, -1)

    @property
    def planes(self) -> tuple[Plane, ...]:
        """As of a Record: one texture of integers."""
        return (Plane("", 0, self.texels, self.channels // self.texels, "u4"),)

    def table_glsl(self) -> str:
        """Accessors: ``quantised_node_lo_x(i)`` and one a field."""
        lines = [f"uniform usampler2D {self.name}_table;"]
        for name, channel, shift, bits in self.fields:
            place = f"i * {self.texels} + {channel // 4}" if self.texels > 1 else "i"
            texel = (f"texelFetch({self.name}_table, table_texel({place}), 0)"
                     f".{'xyzw'[channel % 4]}")
            value = texel if bits == 32 else f"({texel} >> {shift}) & {(1 << bits) - 1}u"
            lines.append(f"uint {self.name}_{name}(int i) {{ return {value}; }}")
        return "\n".join(lines)


def check_count(name: str, count: int) -> None:
    """Raise LimitError for more records than a state in float texels can point at."""
    if count > EXACT_INTEGER:
        raise LimitError(f"{count} {name} records are past 2^24, the last index a float texel "
                         "holds exactly; take a smaller scene or a coarser build")


def _cut_into_texels(fields: Iterable[Field]) -> list[str]:
    """Fields in order, as many a texel as fit: the parts of a layout."""
    texels: list[str] = []
    used = 4
    for field in fields:
        word = f"{field.name}:{field.type}"
        if used + field.width > 4:
            texels.append(word)
            used = field.width
        else:
            texels[-1] += f" {word}"
            used += field.width
    return texels


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

Octant copies store the corner a ray meets first in ``lo`` and the other one in ``hi``.
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

_LINK = "target:30 last:1 leaf:1"
QUANTISED_NODE_16 = PackedRecord(
    "quantised_node", "lo_x:16 hi_x:16 | lo_y:16 hi_y:16 | lo_z:16 hi_z:16 | " + _LINK)
QUANTISED_NODE_8 = PackedRecord(
    "quantised_node", "lo_x:8 hi_x:8 lo_y:8 hi_y:8 | lo_z:8 hi_z:8 | " + _LINK)
"""A threaded node in one integer texel: bounds in steps of the scene's box, rounded outward;
``target`` is a leaf's first triangle (its escape index is the next node) or an inner node's
escape index; ``last`` marks a node with none."""

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

SURFACE = Record("surface", "diffuse:vec3 | normal:vec3")
"""What shading needs of a triangle: colour and unit normal."""

# Streams -----------------------------------------------------------------------------------------

RAY_TEXELS = Record("rays", "origin:vec3 t_min | direction:vec3 t_max")
"""A ray as it lies in its two textures."""

HIT = Record("hit", "t u v triangle:int")
"""The nearest hit so far; triangle -1 while there is none."""

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

LIT = Record("lit", "ambient:vec3 | direct:vec3")
"""Light that leaves a hit towards the eye: what always arrives, and what a shadow takes away."""

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
"""A place in the order: its triangle; the node that is being split there, or -1; 1 where a leaf
begins."""

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
another; its parent in the level above."""

CHUNK = Record("chunk", "lo:vec3 | hi:vec3 | left:vec3 | right:vec3")
"""Some pieces of a node: bounds; how many lie left and right of the node's middle, by axis."""

DECISION = Record("decision", "plane axis:int futile:int")
"""How a node of such a level is split; axis 3: not at all."""

SMALL_NODE = Record("node", "lo:vec3 base:int | hi:vec3 levels:int | mask:vec4")
"""A small node: its box, its root's first piece, how many levels there may be below it, and which
of the root's pieces it holds: 64 bits, 16 a channel."""

EXTENT = Record("extent", "lo hi")
"""A piece along one axis."""

SIDES = Record("sides", "lower_left:vec4 | lower_right:vec4 | upper_left:vec4 | upper_right:vec4")
"""Which pieces of a root lie left and right of where a piece begins and of where it ends, along
one axis: masks as a small node's."""

CHOICE = Record("choice", "plane face:int source:int inner:int")
"""The cheapest plane of a small node: the face of a box, 0 to 5; the extent it is from; whether it
is taken."""

PLACE = Record("place", "at:int pair:int")
"""Where a node stands in depth-first order, and where the pair of its children does."""

BUILT = Record("built", "split axis:int left:int count:int | mask:vec4 | base:int")
"""A node of the finished tree, and where a leaf's pieces are: from base on those of the mask, or
where that is empty the first ones."""

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
