"""THE declaration of every record: which field stands in which texel and channel.

From one declaration come the numpy packer and the GLSL accessors. A record is one of two things:

* a **table** record: many records in one texture, a record's texels side by side. GLSL reads
  ``kd_node_split(i)``;
* a **stream** record: one record a ray, a texture for each texel. GLSL gets a struct, and
  ``state_load(pixel)`` and ``state_store(state)`` that read and write it whole.

A declaration reads like the texels: ``"v0:vec3 index:int | v1:vec3 last:int | v2:vec3"``.
Types are float (the default), vec2, vec3, vec4, int and ivec3. Integers are stored as float
values, exact up to 2^24 either side of zero, and packing raises where one is past that.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .errors import LimitError

TABLE_WIDTH_LOG2 = 12     # tables are 4096 texels wide: shifts and masks, no division
EXACT_INTEGER = 1 << 24   # float32 holds every integer up to here
_WIDTHS = {"float": 1, "int": 1, "vec2": 2, "vec3": 3, "vec4": 4, "ivec3": 3}


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
        return self.type in ("int", "ivec3")

    def decode(self, texel: str) -> str:
        """GLSL that reads the field from a texel."""
        value = f"{texel}.{self.swizzle}"
        return f"{self.type}({value})" if self.is_integer else value

    def encode(self, value: str) -> str:
        """GLSL that turns the field's value into what its channels hold."""
        floats = {"int": "float", "ivec3": "vec3"}
        return f"{floats[self.type]}({value})" if self.is_integer else value


@dataclass(frozen=True)
class Record:
    """A record named ``name`` (GLSL prefix) whose texels are declared in ``layout``."""

    name: str
    layout: str

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
    def components(self) -> int:
        """Channels a texel needs: 1, 2 or 4 (three-channel targets are not portable)."""
        used = max(f.channel + f.width for f in self.fields)
        return 4 if used == 3 else used

    def pack(self, **arrays: np.ndarray) -> np.ndarray:
        """Records from one array a field.

        Parameters
        ----------
        arrays : (n,) or (n, width) each, by field name; a field left out is zero

        Returns
        -------
        (n, texels, components) float32

        Raises
        ------
        LimitError
            where an int field is past 2^24, or there are more records than floats can index.
        """
        unknown = set(arrays) - {f.name for f in self.fields}
        if unknown:
            raise ValueError(f"record {self.name} has no field {', '.join(sorted(unknown))}")
        count = len(next(iter(arrays.values())))
        if count > EXACT_INTEGER:
            raise LimitError(f"{count} {self.name} records are past 2^24, the last index a float "
                             "texel holds exactly; take a smaller scene or a coarser build")
        packed = np.zeros((count, self.texels, self.components), np.float32)
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
        """The inverse of ``pack``: (n, texels, components) -> arrays by field name."""
        fields = {}
        for f in self.fields:
            values = texels[:, f.texel, f.channel:f.channel + f.width]
            values = values[:, 0] if f.width == 1 else values
            fields[f.name] = values.astype(np.int32) if f.is_integer else values
        return fields

    def table_glsl(self) -> str:
        """Accessors of a table record: ``kd_node_split(i)`` and one a field."""
        lines = [f"uniform sampler2D {self.name}_table;"]
        for f in self.fields:
            fetch = (f"texelFetch({self.name}_table, "
                     f"table_texel(i * {self.texels} + {f.texel}), 0)")
            lines.append(f"{f.type} {self.name}_{f.name}(int i) {{ return {f.decode(fetch)}; }}")
        return "\n".join(lines)

    def stream_glsl(self, writes: bool, first_target: int = 0) -> str:
        """Struct, load and, with ``writes``, store of a stream record.

        ``first_target`` is the render target of the record's first texel.
        """
        name, struct = self.name, self.name.capitalize()
        lines = [f"struct {struct} {{"]
        lines += [f"    {f.type} {f.name};" for f in self.fields] + ["};"]
        lines += [f"uniform sampler2D {name}_texel_{k};" for k in range(self.texels)]
        lines += [f"{struct} {name}_load(ivec2 pixel) {{", f"    {struct} record;"]
        for k in range(self.texels):
            lines.append(f"    vec4 texel_{k} = texelFetch({name}_texel_{k}, pixel, 0);")
        for f in self.fields:
            lines.append(f"    record.{f.name} = {f.decode(f'texel_{f.texel}')};")
        lines += ["    return record;", "}"]
        if writes:
            for k in range(self.texels):
                lines.append(f"layout(location = {first_target + k}) out vec4 {name}_target_{k};")
            lines.append(f"void {name}_store({struct} record) {{")
            for k in range(self.texels):
                lines.append(f"    {name}_target_{k} = vec4(0.0);")
            for f in self.fields:
                value = f.encode(f"record.{f.name}")
                lines.append(f"    {name}_target_{f.texel}.{f.swizzle} = {value};")
            lines.append("}")
        return "\n".join(lines)


# Tables ------------------------------------------------------------------------------------------

TRIANGLE = Record("triangle", "v0:vec3 index:int | v1:vec3 last:int | v2:vec3")
"""A triangle; ``index`` its row in the scene, ``last`` 1 where a leaf's run of triangles ends."""

REFERENCE = Record("reference", "triangle:int")
"""An entry of a leaf's or a cell's list: the row of a triangle, or -1, the sentinel."""

GRID_CELL = Record("grid_cell", "first:int")
"""A cell: its first reference, or minus the cells to the nearest occupied one if it is empty (-1
says no more than that it is)."""

KD_NODE = Record("kd_node", "split axis:int left:int count:int")
"""A node: plane, axis (3 a leaf), left child (the right one follows) or first reference."""

KD_BOUNDS = Record("kd_bounds", "lo:vec3 parent:int | hi:vec3")
"""What kd-backtrack adds to a node: its box and its parent."""

BVH_NODE = Record("bvh_node", "lo:vec3 escape:int | hi:vec3 first:int")
"""A threaded node: box, escape index (-1 ends), first triangle of a leaf or -1.

Octant copies store the corner a ray meets first in ``lo`` and the other one in ``hi``.
"""

SURFACE = Record("surface", "diffuse:vec3 | normal:vec3")
"""What shading needs of a triangle: colour and unit normal."""

# Streams -----------------------------------------------------------------------------------------

RAY_TEXELS = Record("rays", "origin:vec3 t_min | direction:vec3 t_max")
"""A ray as it lies in its two textures."""

HIT = Record("hit", "t u v triangle:int")
"""The nearest hit so far; triangle -1 while there is none."""

COUNTERS = Record("counters", "nodes_visited:int leaves_visited:int triangles_tested:int")
"""What a ray did; exists only in programs with statistics."""

LIT = Record("lit", "ambient:vec3 | direct:vec3")
"""Light that leaves a hit towards the eye: what always arrives, and what a shadow takes away."""
