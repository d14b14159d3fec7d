"""Tests of `Places`, which gives the boxes and the decoded records of the nodes or cells that rays
visit."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.packed_record import PackedRecord
from gpgpu_rt.inspect.places import Places
from gpgpu_rt.inspect.time_travel import Fields, travel

SIZE = (24, 18)


def states(tracer: rt.Tracer) -> list[Fields]:
    found: list[Fields] = []
    travel(tracer, *tracer.scene.camera.rays(SIZE), lambda one: found.append(one.state))
    return found


@pytest.mark.parametrize("method, options, records", [
    ("kd-backtrack", {}, {"kd_node", "kd_bounds"}),
    ("kd-restart", {"precision": "fp16"}, {"kd_node"}), ("grid", {}, {"grid_cell"}),
    ("bvh-threaded", {}, {"bvh_node"}), ("bvh-threaded", {"quantise_nodes": 8},
                                         {"quantised_node"}),
    ("bvh-threaded", {"quantise_nodes": 16, "octants": True}, {"quantised_node"}),
    ("bvh-packet", {}, {"bvh_pair"}), ("bih", {}, {"bih_node", "bih_bounds"}),
    ("tree-unit", {}, {"unit_node", "unit_bounds"})])
def test_records_equal_the_tables(soup: str, method: str, options: dict[str, Any],
                                  records: set[str]) -> None:
    with rt.Tracer(rt.load_scene(soup), method, schedule="step", **options) as tracer:
        seen = states(tracer)
        places = Places(tracer, seen[0])
        numbers = np.unique(np.concatenate([places.numbers(state) for state in seen]))
        numbers = numbers[numbers >= 0]
        assert len(numbers) > 3 and numbers.max() < places.count
        for number in (numbers[0], numbers[len(numbers) // 2], numbers[-1]):
            found = places.records(int(number))
            assert found.keys() == records
            for name, fields in found.items():
                table = tracer.accelerator.tables[name]
                assert fields.keys() == table.keys() or method == "bvh-threaded"
                for field, value in fields.items():
                    wanted = np.asarray(table[field][number:number + 1])[0]
                    near = 2e-3 if "precision" in options else 0
                    assert np.allclose(value, wanted, near, near), (name, field)


def test_a_cell_keeps_its_record_if_slices_are_padded(soup: str) -> None:
    """In the era form with fp24, the table of cells has unused entries after each slice."""
    scene = rt.load_scene(soup)
    with (rt.Tracer(scene, "grid", schedule="step") as today,
          rt.Tracer(scene, "grid", era="r420") as era):
        plain, padded = (Places(tracer, states(tracer)[0]) for tracer in (today, era))
        assert len(era.accelerator.tables["grid_cell"]["first"]) > padded.count == plain.count
        records = [[places.records(number) for number in range(0, plain.count, 7)]
                   for places in (plain, padded)]
    assert records[0] == records[1] and len({str(one) for one in records[0]}) > 3


def test_texels_that_passes_wrote_are_read(soup: str) -> None:
    """Passes write the boxes of geometry images, so only the textures hold these boxes."""
    with rt.Tracer(rt.load_scene(soup), "geometry-image", schedule="step") as tracer:
        places = Places(tracer, states(tracer)[0])
        numbers = np.arange(0, places.count, max(1, places.count // 7))
        for number, (lo, hi) in zip(numbers, places.boxes(numbers)):
            found = places.records(int(number))
            assert np.allclose(found["min_pyramid"]["lo"], lo, atol=1e-5)
            assert np.allclose(found["max_pyramid"]["hi"], hi, atol=1e-5)


def test_cells_have_numbers_and_boxes(soup: str) -> None:
    with rt.Tracer(rt.load_scene(soup), "grid", schedule="step", resolution=(3, 4, 5)) as tracer:
        cells = np.array([[0, 0, 0], [2, 3, 4], [1, 0, 3], [3, 0, 0], [-1, 0, 0]])
        places = Places(tracer, {"cell": cells})
        numbers = places.numbers({"cell": cells, "phase": np.array([1, 1, 1, 1, 1])})
        assert numbers.tolist() == [0, 59, 1 + 12 * 3, -1, -1]
        grid = tracer.accelerator.structure
        assert np.allclose(places.boxes(numbers[:3])[:, 0],
                           grid.lo + cells[:3] * grid.cell_size)
        assert (places.numbers({"cell": cells, "phase": np.zeros(5)}) == -1).all()


def test_a_method_without_places_has_none(soup: str, tmp_path: Path) -> None:
    with rt.Tracer(rt.load_scene(soup), "brute-force", schedule="step") as tracer:
        state = states(tracer)[0]
        places = Places(tracer, state)
        assert places.kind == "" and (places.numbers(state) == -1).all()


def test_a_packed_record_is_unpacked() -> None:
    record = PackedRecord("nodes", "a:16 b:16 | c:32 | d:1 e:31 | f:8 | g:5 h:27")
    rng = np.random.default_rng(3)
    arrays = {name: rng.integers(0, 1 << bits, 9) for name, _, _, bits in record.fields}
    found = record.unpack(record.pack(**arrays))
    assert all((found[name] == values).all() for name, values in arrays.items())
