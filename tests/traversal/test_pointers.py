"""In the era form with fp24, a pointer is a texel's column and row (glsl/core/pointer.glsl)."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.era_accessors import table_places
from gpgpu_rt.gl.precision import FORMATS, ROUNDINGS
from gpgpu_rt.gl.record import Record, texel_indices, texels_of
from gpgpu_rt.gl.textures import TABLE_WIDTH
from gpgpu_rt.methods import methods
from gpgpu_rt.scene.loading import load_scene
from gpgpu_rt.traversal.leaf_lists import leaf_tables
from gpgpu_rt.traversal.triangle_table import REFERENCE

TEXELS = Record("leaf", "lo:vec3 escape:pointer | hi:vec3 first:pointer | count:int"
                ).with_texel_pointers()
NAMES = [row.name for row in methods()
         if not row.why_no_era_form("r420") and row.era_packets is None]


@pytest.mark.parametrize("row", [0, 1, 31, 32, 4095])
def test_an_index_becomes_a_column_and_a_row(row: int) -> None:
    indices = row * TABLE_WIDTH + np.array([0, 1, TABLE_WIDTH - 1])
    np.testing.assert_array_equal(texels_of(indices), [(0, row), (1, row), (4095, row)])
    np.testing.assert_array_equal(texel_indices(texels_of(indices)), indices)


def test_a_pointer_to_no_element_stays_a_number_below_0() -> None:
    codes = np.array([-1, -2, -17])
    np.testing.assert_array_equal(texels_of(codes), [(-1, 0), (-2, 0), (-17, 0)])
    np.testing.assert_array_equal(texel_indices(texels_of(codes)), codes)


def test_fields_fill_the_first_texel_with_free_channels() -> None:
    assert TEXELS.layout == "lo:vec3 count:int | escape:texel first:texel | hi:vec3"
    escape, first = np.array([-1, 4095, 4096]), np.array([70_000, 0, -1])
    packed = TEXELS.pack(lo=np.zeros((3, 3)), hi=np.ones((3, 3)), escape=escape, first=first)
    np.testing.assert_array_equal(packed[:, 1], [(-1, 0, 368, 17), (4095, 0, 0, 0), (0, 1, -1, 0)])
    unpacked = TEXELS.unpack(packed)
    np.testing.assert_array_equal(unpacked["escape"], escape)
    np.testing.assert_array_equal(unpacked["first"], first)


def test_a_marked_list_ends_at_its_mark() -> None:
    """Node 0 is inner. Nodes 1, 2 and 3 are leaves with 2, 0 and 1 references."""
    node = Record("node", "left:pointer count:int")
    fields = {"left": np.array([1, 0, 2, 2]), "count": np.array([3, 2, 0, 1])}
    leaf, references = np.array([False, True, True, True]), np.array([7, 5, 9])
    counted, marked = (leaf_tables(node, fields, "left", leaf, references, {"era": era})
                       for era in (None, "r420"))
    assert counted == {"node": fields, "reference": {"triangle": references}}
    assert marked["node"].keys() == {"left"}
    np.testing.assert_array_equal(marked["node"]["left"], [1, 0, -1, 2])
    np.testing.assert_array_equal(marked["reference"]["last"], [0, 1, 1])


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("rows", [1, 3, 32, 1000, 4096])
def test_fp24_distinguishes_all_texels_of_a_table(rows: int, rounding: str) -> None:
    """Rounded to fp24, the texture coordinates of a texel still lie in this texel."""
    places = table_places(REFERENCE.with_texel_pointers(), rows)

    def rounded(values: object) -> np.ndarray:
        return FORMATS["fp24"].round(np.asarray(values, np.float32), rounding)
    for axis, size in ((0, TABLE_WIDTH), (1, rows)):
        texels = np.arange(size, dtype=np.float32)
        np.testing.assert_array_equal(rounded(texels), texels)
        step, start = (rounded(places[f"reference_{name}"][axis]) for name in ("step", "start"))
        at = rounded(texels * step + start).astype(np.float64) * size
        np.testing.assert_array_equal(np.floor(at), texels)


@pytest.mark.parametrize("name, options", [
    *((name, {}) for name in NAMES if name != "brute-force"),
    ("bvh-threaded", {"octants": True}), ("tree-unit", {"criterion": "box"}),
    ("grid", {"resolution": (70, 70, 20)}), ("grid-proximity", {"resolution": (70, 70, 20)})],
    ids=str)
def test_walks_cross_the_rows_of_tables(name: str, options: dict) -> None:
    """With tables of several rows, the era form finds the same triangles at the same t as today's
    form in fp24. The grids have slices of 4,900 cells, more than a row holds."""
    scene = load_scene("bunny")
    rays = scene.camera.rays((48, 48))
    with rt.Tracer(scene, name, precision="fp24", intersection="moller-trumbore",
                   **options) as tracer:
        today = tracer.trace(*rays)
    with rt.Tracer(scene, name, era="r420", **options) as tracer:
        found = tracer.trace(*rays)
        rows = [texture.height for texture in tracer.session.tables.samplers().values()]
    assert max(rows) > 2 and today.hit.sum() > 400
    np.testing.assert_array_equal(found.triangle, today.triangle)
    np.testing.assert_array_equal(found.t, today.t)
