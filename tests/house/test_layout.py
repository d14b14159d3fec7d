"""Records: the Python packer and the GLSL accessors agree, and indices beyond float32's exact
integers are refused."""
from __future__ import annotations

import importlib
from pathlib import Path

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gpgpu_rt as rt
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.precision import PRECISIONS, Precision
from gpgpu_rt.gl.record import EXACT_INTEGER, Record
from gpgpu_rt.gl.textures import make_texture, read_texture, table_textures
from gpgpu_rt.traversal.records import STATE

PACKAGE = Path(rt.__file__).parent
MODULES = [importlib.import_module(".".join(("gpgpu_rt", *path.relative_to(PACKAGE).parts))[:-3])
           for path in sorted(PACKAGE.glob("**/*.py"))
           if path.name in ("records.py", "triangle_table.py")]
RECORDS = list({id(r): r for module in MODULES for r in vars(module).values()
                if isinstance(r, Record)}.values())
pytestmark = pytest.mark.small


def fields_of(record: Record, count: int, seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {f.name: rng.integers(-1, EXACT_INTEGER, (count, f.width)) if f.is_integer
            else rng.normal(size=(count, f.width)).astype(np.float32) for f in record.fields}


def test_records_have_names_of_their_own() -> None:
    """Every record has its own name, the prefix of its GLSL accessors. There are two exceptions. A
    record with a GLSL define is a variant of another record. The states of all methods share one
    name, because a program has only one state."""
    names = [record.name for record in RECORDS if not getattr(record, "define", "")
             and record.name != STATE.name]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
@given(seed=st.integers(0, 99))
def test_pack_and_unpack(record: Record, seed: int) -> None:
    fields = fields_of(record, 5, seed)
    unpacked = record.unpack(record.pack(**fields))
    for name, values in fields.items():
        assert (unpacked[name].reshape(values.shape) == values).all()


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
def test_fields_that_are_not_given_are_zero(record: Record) -> None:
    """`pack` and `pack_into` write 0 to the fields that are not given."""
    fields = fields_of(record, 3, 1)
    some = dict(list(fields.items())[::2])
    out = np.full((3, record.texels, 4), np.nan, np.float32)
    record.pack_into(out.swapaxes(0, 1), **some)
    assert np.array_equal(out, record.pack(**some))
    rest = {name: values for name, values in record.unpack(out).items() if name not in some}
    assert all((values == 0).all() for values in rest.values()) and not np.isnan(out).any()


@pytest.mark.parametrize("storage", PRECISIONS)
@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
def test_glsl_reads_what_python_packed(record: Record, storage: str, tmp_path) -> None:
    """Each GLSL accessor reads its own field, also across the row breaks of a table."""
    gpu = open_gpu()
    count = 4096 // record.texels + 40
    precision = Precision(storage=storage)
    fields = precision.stored_fields(record, fields_of(record, count, 3))
    record = precision.layout(record)
    tables = table_textures(gpu, record, fields)
    for field in record.fields:
        probe = tmp_path / "probe.frag"
        probe.write_text(
            '#version 330 core\n#include "core/fetch.glsl"\n#include <tables>\n'
            "out vec4 value;\nvoid main() {\n"
            f"    {field.glsl_type} read = {record.name}_{field.name}(int(gl_FragCoord.x));\n"
            "    value = vec4(" + ", ".join(["vec3(read)" if field.width == 3 else "read"]
                                            + ["0.0"] * (4 - field.width)) + ");\n}\n")
        reader = FullScreenPass(gpu, str(probe), {"TABLE_WIDTH_LOG2": 12},
                                {"tables": record.table_glsl()})
        target = gpu.context.framebuffer([make_texture(gpu, (count, 1), 4, "probe")])
        gpu.context.enable_only(moderngl.NOTHING)
        reader.draw(target, tables)
        read = read_texture(target.color_attachments[0])[0, :, :field.width]
        assert (read == fields[field.name]).all(), field.name


@pytest.mark.parametrize("value, fits", [(EXACT_INTEGER - 1, True), (EXACT_INTEGER, True),
                                         (EXACT_INTEGER + 1, False), (-EXACT_INTEGER - 1, False)])
def test_integers_that_a_float_cannot_store_are_refused(value: int, fits: bool) -> None:
    record = Record("r", "i:int")
    if fits:
        assert record.unpack(record.pack(i=np.array([value])))["i"][0] == value
    else:
        with pytest.raises(rt.LimitError, match="2\\^24"):
            record.pack(i=np.array([value]))


def test_a_texel_holds_four_channels() -> None:
    with pytest.raises(ValueError, match="four channels"):
        Record("r", "a:vec3 b:vec2").fields
    with pytest.raises(ValueError, match="no field"):
        Record("r", "a").pack(b=np.zeros(1))


def test_texture_past_the_limit() -> None:
    gpu = open_gpu()
    with pytest.raises(rt.LimitError, match="fewer rays"):
        make_texture(gpu, (gpu.max_texture_size + 1, 1), 4, "test")
