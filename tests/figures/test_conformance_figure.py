"""Tests of the figure on conformance: its measurement runs the conformance suite, and its page
shows the suite's rows."""
from __future__ import annotations

from pathlib import Path

import pytest
from faked_cells import write_cell

from gpgpu_rt.conform.families import FAMILIES
from gpgpu_rt.conform.suite import KINDS, Row, installed
from gpgpu_rt.figures.experiments import conformance, conformance_runs


@pytest.mark.once
def test_the_measurement_has_every_engine_and_family() -> None:
    rows = [Row(**row) for row in conformance_runs.measure(1)["rows"]]
    engines = {"bvh-threaded", *(one.name for one in installed()[0])}
    assert {(row.engine, row.family) for row in rows} == {
        (engine, family) for engine in engines for family in FAMILIES}
    assert not any(row.wrong_rays for row in rows if row.engine == "bvh-threaded")


def _row(engine: str, family: str, **more: int) -> dict:
    return Row(engine, "1.0", family, 289, 3, {**dict.fromkeys(KINDS, 0), **more}, 0.1).to_dict()


def test_the_page_has_wrong_rays_crashes_and_rays_that_were_not_cast(tmp_path: Path) -> None:
    rows = [_row("sharp", "spanning"), _row("blunt", "spanning", leak=7),
            _row("blunt", "diagonals", crash=289)]
    write_cell(conformance.cells(False)[0], tmp_path, rows=rows)
    conformance.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "conformance.md").read_text()
    assert "| sharp 1.0 | 289 | 3 | 0 |" in page
    assert "| blunt 1.0 | 578 | 6 | 296 | 7 |" in page
    assert "| spanning | 0 of 289 | 7 of 289 |" in page
    assert "| - | crash, 289 of 289 |" in page and "| segments | - | - |" in page
    assert (tmp_path / "conformance.png").read_bytes()[:4] == b"\x89PNG"
