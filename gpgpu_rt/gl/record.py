"""Records: a declaration lists fields in texels; numpy packs the fields, and GLSL reads them.

Texels of records form a table or a stream. Programs read a table by index; passes read and write a
stream. A declaration lists fields texel by texel: ``"v0:vec3 index:int | v1:vec3 last:int"``.
Types are float (the default), vec2, vec3, vec4, int, ivec3, ivec4 and pointer. Integers are stored
as floats, exact from -2^24 to 2^24. A pointer is the index of a table's element
(glsl/core/pointer.glsl).

Fields other than integers are geometric: the option ``storage`` sets their format, unless the
record has ``full_precision``. Under fp16, they have their own texels, in half float textures.
"""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from ..errors import LimitError
from .texel_channels import write_channels

# Tables are 4096 texels wide, so addresses need shifts and masks, not divisions.
TABLE_WIDTH_LOG2 = 12
EXACT_INTEGER = 1 << 24   # float32 holds every integer up to this number
SMALL_INTEGER = 1 << 22   # core/fetch.glsl converts integers up to this number by their bits
FIELD_TYPES = {"float": 1, "int": 1, "vec2": 2, "vec3": 3, "vec4": 4, "ivec3": 3, "ivec4": 4,
               "pointer": 1}    # type -> number of channels
FLOATS = {"int": "float", "ivec3": "vec3", "ivec4": "vec4"}    # GLSL type -> type of floats
TEXEL = "texel"    # a pointer that is a column and a row (`Record.with_texel_pointers`)


@dataclass(frozen=True)
class Field:
    """A field of a record: its GLSL type, its texel and its first channel."""

    name: str
    type: str
    texel: int
    channel: int

    @property
    def width(self) -> int:
        return 2 if self.type == TEXEL else FIELD_TYPES[self.type]

    @property
    def swizzle(self) -> str:
        return "xyzw"[self.channel:self.channel + self.width]

    @property
    def is_integer(self) -> bool:
        return self.type in ("int", "ivec3", "ivec4", "pointer", TEXEL)

    @property
    def glsl_type(self) -> str:
        return {"pointer": "int", TEXEL: "vec2"}.get(self.type, self.type)

    def of(self, texels: np.ndarray) -> np.ndarray:
        """Return the field's values, (...) or (..., width), from its texels, (..., 4)."""
        values = texels[..., self.channel:self.channel + self.width]
        if self.type == TEXEL:
            return texel_indices(values)
        values = values[..., 0] if self.width == 1 else values
        return values.astype(np.int32) if self.is_integer else values

    def channels(self, values: np.ndarray) -> np.ndarray:
        """Return the numbers to store for ``values``, (n,) or (n, width), as (n, width)."""
        if self.type == TEXEL:
            return texels_of(values)
        return values.reshape(len(values), self.width)

    def decode(self, texel: str) -> str:
        value = f"{texel}.{self.swizzle}"
        return f"{self.glsl_type}({value})" if self.is_integer else value

    def encode(self, value: str) -> str:
        return f"{FLOATS.get(self.glsl_type, 'vec2')}({value})" if self.is_integer else value


@dataclass(frozen=True)
class Plane:
    """Consecutive texels of a record in the same texture.

    ``suffix`` distinguishes a table's textures. ``components`` is 1, 2 or 4, because targets with
    three channels are not portable. ``dtype`` is f4, f2 or u4.
    """

    suffix: str
    first: int
    texels: int
    components: int
    dtype: str


@dataclass(frozen=True)
class Record:
    """A record: fields in texels, which numpy packs and GLSL reads.

    Attributes
    ----------
    name : Name of the record, and prefix of its accessors in GLSL.
    layout : Declaration of the fields.
    storage : Format of the geometric fields. Set by ``stored``.
    half_texels : The first ``half_texels`` texels are in half float textures. Set by ``stored``.
    uniform_texels : Texels that are the same for all of a stream's records. Programs read these
        from uniforms. If texel 0 of ``rays`` is uniform, the define RAYS_TEXEL_0_UNIFORM is set.
    define : GLSL define that distinguishes a stream's record from records of the same name with
        other fields.
    constants : Special values of integer fields, as (name, value); GLSL gets them as defines.
    full_precision : Whether geometric fields stay float32 under every ``storage``.
    is_apart : Whether each texel of a table's records has its own texture. Set by ``apart``.
    texel_pointers : Whether a pointer is a column and a row. Set by ``with_texel_pointers``.
    """

    name: str
    layout: str
    storage: str = "fp32"
    half_texels: int = 0
    uniform_texels: tuple[int, ...] = ()
    define: str = ""
    constants: tuple[tuple[str, int], ...] = ()
    full_precision: bool = False
    is_apart: bool = False
    texel_pointers: bool = False

    @lru_cache(maxsize=None)
    def stored(self, storage: str) -> Record:
        """Return this record for ``storage``. Under fp16, geometric fields come first."""
        if self.full_precision:
            return self
        if storage != "fp16":
            return replace(self, storage=storage)
        groups = [_cut_into_texels(f for f in self.fields if f.is_integer is integer)
                  for integer in (False, True)]
        return replace(self, layout=" | ".join(groups[0] + groups[1]), storage=storage,
                       half_texels=len(groups[0]))

    def extended(self, more: str) -> Record:
        return replace(self, layout=f"{self.layout} | {more}")

    def without(self, name: str) -> Record:
        """Return this record without a field and without emptied texels."""
        kept = [[word for word in texel.split() if word.partition(":")[0] != name]
                for texel in self.layout.split("|")]
        return replace(self, layout=" | ".join(" ".join(words) for words in kept if words))

    def apart(self) -> Record:
        """Return this record with a texture for each texel, as in the papers: the texels of an
        element then have the same texture coordinates."""
        return replace(self, is_apart=True)

    def with_texel_pointers(self) -> Record:
        """Return this record with pointers of two channels, a column and a row. Each field is
        placed in the first texel with enough free channels."""
        texels: list[list[Field]] = []
        for field in self.fields:
            wide = replace(field, type=TEXEL) if field.type == "pointer" else field
            room = (one for one in texels if sum(f.width for f in one) + wide.width <= 4)
            into = next(room, None)
            if into is None:
                texels.append(into := [])
            into.append(wide)
        layout = " | ".join(" ".join(f"{f.name}:{f.type}" for f in one) for one in texels)
        return replace(self, layout=layout, texel_pointers=True)

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
        return self.layout.count("|") + 1

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """The texels of the record, grouped by texture type."""
        half = self.half_texels
        parts: tuple[tuple[str, int, int, str], ...] = (
            ("_half", 0, half, "f2"), ("", half, self.texels - half, "f4"))
        if self.is_apart:
            parts = tuple((f"_{k}", k, 1, "f2" if k < half else "f4") for k in range(self.texels))
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
        """Return the texels of records, (n, texels, 4) float32, from an array per field.

        Parameters
        ----------
        arrays : as for ``pack_into``

        Raises
        ------
        LimitError
            as ``pack_into``
        """
        packed = np.empty((len(next(iter(arrays.values()))), self.texels, 4), np.float32)
        self.pack_into(packed.swapaxes(0, 1), **arrays)
        return packed

    def pack_into(self, planes: Sequence[np.ndarray | None] | np.ndarray,
                  **arrays: np.ndarray) -> None:
        """Write the texels of records, from an array per field, into ``planes``.

        Parameters
        ----------
        planes : an array per texel, (n, 4) float32 with any strides; None skips the texel
        arrays : (n,) or (n, width) each, by field name; a missing field is zero

        Raises
        ------
        LimitError
            for an integer outside of -2^24 to 2^24, or more records than floats can index
        """
        unknown = set(arrays) - {f.name for f in self.fields}
        if unknown:
            raise ValueError(f"record {self.name} has no field {', '.join(sorted(unknown))}")
        count = len(next(iter(arrays.values())))
        check_count(self.name, count)
        given = sorted((field for field in self.fields if field.name in arrays),
                       key=lambda field: (field.texel, field.channel))
        for field in given:
            if planes[field.texel] is None:
                continue
            values = np.asarray(arrays[field.name])
            if field.is_integer and count and np.abs(values).max() > EXACT_INTEGER:
                raise LimitError(f"{self.name}.{field.name} is past 2^24, the last integer a "
                                 "float texel holds exactly; use a smaller scene")
            write_channels(planes[field.texel], field.channel, field.channels(values))
        filled = {(f.texel, f.channel + k) for f in given for k in range(f.width)}
        for texel, channel in set(np.ndindex(self.texels, 4)) - filled:
            if planes[texel] is not None:
                planes[texel][:, channel] = 0

    def unpack(self, texels: np.ndarray) -> dict[str, np.ndarray]:
        """Return arrays by field name, (...) or (..., width), from texels, (..., texels, 4): the
        inverse of ``pack``. Arrays of float fields are views."""
        return self.unpack_planes(np.moveaxis(texels, -2, 0))

    def field(self, name: str) -> Field:
        return next(field for field in self.fields if field.name == name)

    def unpack_planes(self, planes: Sequence[np.ndarray] | np.ndarray) -> dict[str, np.ndarray]:
        """Return arrays by field name, as ``unpack``, from an array (..., 4) per texel."""
        return {f.name: f.of(planes[f.texel]) for f in self.fields}

    def table_glsl(self) -> str:
        """Return a table's GLSL accessors, a function per field: ``kd_node_split(i)``."""
        lines = [sampler_glsl("sampler2D", self.name + plane.suffix) for plane in self.planes]
        for f in self.fields:
            plane = self.plane_of(f.texel)
            place = f"i * {plane.texels} + {f.texel - plane.first}"
            fetch = f"TABLE_FETCH({self.name}{plane.suffix}, {place})"
            whole = f.glsl_type == "int"
            value = f"TABLE_INTEGER({fetch}.{f.swizzle})" if whole else f.decode(fetch)
            lines.append(f"{f.glsl_type} {self.name}_{f.name}(int i) {{ return {value}; }}")
        return "\n".join(lines)

    def stream_glsl(self, writes: bool, first_target: int = 0, reads: bool = True) -> str:
        """Return the GLSL struct and load function of a stream record.

        ``writes`` adds the store function, which rounds to ``storage`` and writes to the render
        targets from ``first_target`` on. Without ``reads``, the record stays in registers. A
        function that rounds a record to ``storage`` then replaces the load function.
        """
        name, struct = self.name, self.name.capitalize()
        lines = ['#include "core/texel.glsl"']
        lines += [f"#define {self.define}"] if self.define else []
        lines += [f"#define {name.upper()}_TEXEL_{k}_UNIFORM" for k in self.uniform_texels]
        for constant, value in self.constants:     # records may share a constant
            lines += [f"#ifndef {constant}", f"#define {constant} {value}", "#endif"]
        by_texel = [[f for f in self.fields if f.texel == k] for k in range(self.texels)]
        declared = [" ".join(f"{f.glsl_type} {f.name};" for f in fields)
                    for fields in by_texel if fields]
        lines += [f"struct {struct} {{ {declared[0]} }};"] if len(declared) == 1 else [
            f"struct {struct} {{", *(f"    {texel}" for texel in declared), "};"]
        lines += self._load_glsl(struct) if reads else []
        lines += self._stored_glsl(struct) if writes or not reads else []
        lines += self._store_glsl(struct, by_texel, first_target) if writes else []
        return "\n".join(lines)

    def _load_glsl(self, struct: str) -> list[str]:
        name = self.name
        kinds = ["vec4" if k in self.uniform_texels else "sampler2D" for k in range(self.texels)]
        lines = [f"uniform {kind} {name}_texel_{k};" for k, kind in enumerate(kinds)]
        sampled = [k for k, kind in enumerate(kinds) if kind == "sampler2D"]
        if sampled:
            lines.append(f"vec2 {name}_texel_step = "
                         f"1.0 / vec2(textureSize({name}_texel_{sampled[0]}, 0));")
        lines.append(f"{struct} {name}_load(ivec2 pixel) {{")
        for k in range(self.texels):
            value = f"{name}_texel_{k}"
            if k in sampled:
                value = f"TEXEL({value}, {name}_texel_step, pixel)"
            lines.append(f"    vec4 texel_{k} = {value};")
        read = ", ".join(f.decode(f"texel_{f.texel}") for f in self.fields)
        return [*lines, f"    return {struct}({read});", "}"]

    @property
    def _is_rounded(self) -> bool:
        return self.storage != "fp32" and not all(f.is_integer for f in self.fields)

    def _stored_glsl(self, struct: str) -> list[str]:
        rounded = [f for f in self.fields if not f.is_integer] if self._is_rounded else []
        return [f"{struct} {self.name}_stored({struct} record) {{",
                *(f"    record.{f.name} = stored(record.{f.name});" for f in rounded),
                "    return record;", "}"]

    def _store_glsl(self, struct: str, by_texel: Sequence[Sequence[Field]],
                    first_target: int) -> list[str]:
        name = self.name
        lines = [f"layout(location = {first_target + k}) out vec4 {name}_target_{k};"
                 for k in range(self.texels)]
        lines.append(f"void {name}_store({struct} record) {{")
        lines += [f"    record = {name}_stored(record);"] if self._is_rounded else []
        for k, fields in enumerate(by_texel):
            free = 4 - sum(f.width for f in fields)
            values = [*(f.encode(f"record.{f.name}") for f in fields), *["0.0"] * free]
            lines.append(f"    {name}_target_{k} = vec4({', '.join(values)});")
        return [*lines, "}"]


def sampler_glsl(sampler: str, name: str) -> str:
    """Return GLSL that TABLE_FETCH(name, i) needs: the texture, and 1 / the texture's height."""
    return (f"uniform {sampler} {name}_table;\n"
            f"float {name}_table_row = 1.0 / float(textureSize({name}_table, 0).y);")


def check_count(name: str, count: int) -> None:
    """Raise LimitError for more records than a float texel can index."""
    if count > EXACT_INTEGER:
        raise LimitError(f"{count} {name} records are past 2^24, the last index a float texel "
                         "holds exactly; use a smaller scene or a coarser build")


def texels_of(indices: np.ndarray) -> np.ndarray:
    """Return pointers as columns and rows, (..., 2), from indices (...). A negative index becomes
    the column, and the row is 0."""
    row = np.maximum(indices, 0) >> TABLE_WIDTH_LOG2
    return np.stack([indices - (row << TABLE_WIDTH_LOG2), row], axis=-1)


def texel_indices(texels: np.ndarray) -> np.ndarray:
    """Return indices, (...) int32, from columns and rows, (..., 2): the inverse of `texels_of`."""
    whole = texels.astype(np.int32)
    return whole[..., 0] + (whole[..., 1] << TABLE_WIDTH_LOG2)


def _cut_into_texels(fields: Iterable[Field]) -> list[str]:
    """Return the layouts of texels with the fields in order. A field that does not fit begins a
    new texel."""
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


def streams_glsl(reads: Iterable[Record], writes: Iterable[Record],
                 registers: Iterable[Record] = ()) -> str:
    """Return the text of ``#include <streams>``: the accessors of a pass's streams.

    Written streams use the render targets in order. Records in ``registers`` have no textures in
    the pass.
    """
    texts, target = [record.stream_glsl(writes=False) for record in reads], 0
    texts += [record.stream_glsl(writes=False, reads=False) for record in registers]
    for record in writes:
        texts.append(record.stream_glsl(True, target))
        target += record.texels
    return "\n".join(texts)
