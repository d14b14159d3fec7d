"""The page of predicted and published times shows the numbers of its data."""
from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from gpgpu_rt.figures.experiments import period
from gpgpu_rt.figures.framework import results
from gpgpu_rt.hardware.cards import find_card

TURNS = {"kd-restart": 100, "packets": 40, "+ push-down": 30, "+ short stack": 20}


def _write(data: Path) -> period.Experiment:
    """Writes the cells of Figure 13 on cornell with primary rays. A fragment runs a loop of 50
    instructions TURNS times."""
    one = next(e for e in period.EXPERIMENTS if e.figure.name == "fig13")
    for panel, column in one.pairs():
        if (panel.scene, panel.rays) != ("cornell", "primary"):
            continue
        runs = {str(w): 480 // w for w in (1, 48)}
        work = {"rays": 480, "pixels": 480, "fragments": 480, "texel_bytes": {},
                "written_bytes": 16, "regions": [
                    {"vector": 0, "scalar": 0, "fetches": {}, "loop": False, "parent": -1,
                     "runs": runs},
                    {"vector": 50, "scalar": 50, "fetches": {}, "loop": True, "parent": 0,
                     "runs": {w: n * TURNS[column.label] for w, n in runs.items()}}]}
        for cell in one.cells(panel, column):
            (data / cell.name).write_text(json.dumps(
                {"settings": results.settings(cell), "work": work,
                 "scene": {"stand_in": None, "triangles": 32, "name": "cornell"}}))
    return one


def test_the_page_holds_what_the_data_say(tmp_path: Path) -> None:
    one = _write(tmp_path)
    period.draw(tmp_path, tmp_path, full=False)
    with (tmp_path / "period.csv").open() as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert set(rows) == set(TURNS)
    rate = find_card(one.chip).vector_rate
    plain = {name: 1e9 * 50 * turns / rate for name, turns in TURNS.items()}
    published = {"kd-restart": 38.3, "packets": 17.5, "+ push-down": 88.8, "+ short stack": 91.3}
    ratios = sorted(plain[name] * published[name] / 1e3 for name in TURNS)
    share = (ratios[1] + ratios[2]) / 2  # the median: half are too fast, half too slow
    for name, row in rows.items():
        assert float(row["predicted_ns"]) == pytest.approx(plain[name] / share, rel=2e-3)
        assert float(row["published_ns"]) == pytest.approx(1e3 / published[name])
        assert float(row["utilisation"]) == pytest.approx(1.0)
    page = (tmp_path / "period.md").read_text()
    # kd-restart and packets have the opposite order here. The last two columns tie in the paper.
    assert "cornell, primary: tau-b 0.55 of 4 methods" in page
    assert (tmp_path / "period.png").stat().st_size > 10_000


def test_cells_of_stand_ins_are_left_to_the_full_size() -> None:
    quick, full = ({cell.scene for cell in period.cells(size)} for size in (False, True))
    assert "cows" not in quick and "cows" in full and quick < full
    assert {"cornell", "bunny", "robots", "kitchen", "conference"} <= quick


def test_tiles_are_weighed_by_the_whole_image(tmp_path: Path) -> None:
    one = _write(tmp_path)
    plain = {row.column.label: row for row in period.rows(tmp_path)}
    for panel, column in one.pairs():
        if (panel.scene, panel.rays) == ("cornell", "primary"):
            for cell in one.cells(panel, column):
                result = json.loads((tmp_path / cell.name).read_text())
                result["work"] |= {"image": {"steps": 30, "rays": 0.5},
                                   "tiles": {"steps": 20, "rays": 1.0}}
                (tmp_path / cell.name).write_text(json.dumps(result))
    for row in period.rows(tmp_path):
        row.predict(1.0)
        before = plain[row.column.label]
        before.predict(1.0)
        # The image has half as many rays per pixel as the tiles, and 1.5 times as much work per
        # pixel.
        assert row.ns == pytest.approx(1.5 / 0.5 * before.ns)
