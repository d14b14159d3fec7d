"""The notebook examples/tour.ipynb runs from top to bottom, and a notebook can display the value
of each cell."""
from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import gpgpu_rt as rt

TOUR = Path(rt.__file__).parents[1] / "examples" / "tour.ipynb"
CELLS = json.loads(TOUR.read_text(encoding="utf-8"))["cells"]
CODE = ["".join(cell["source"]) for cell in CELLS if cell["cell_type"] == "code"]


def value_of(cell: str, names: dict[str, Any]) -> Any:
    """Runs a cell; returns the value of its last line, as a notebook does."""
    *body, last = ast.parse(cell).body
    exec(compile(ast.Module(body, []), "cell", "exec"), names)
    if isinstance(last, ast.Expr):
        return eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    exec(compile(ast.Module([last], []), "cell", "exec"), names)
    return None


def test_the_tour_runs(exact_renderer) -> None:
    names: dict[str, Any] = {}
    shown = [value for cell in CODE if (value := value_of(cell, names)) is not None]
    kinds = [type(value).__name__ for value in shown]
    assert kinds == ["Scene", "Tracer", "Hits", "Statistics", "dict", "Image", "tuple",
                     "Animation", "Image", "Statistics", "float"]
    for value in shown:
        assert len(repr(value)) < 300 and "\n" not in repr(value)
        if type(value).__module__.startswith("gpgpu_rt"):
            assert value._repr_html_().startswith(("<table>", "<div"))
        if isinstance(value, Image.Image):
            assert value._repr_png_() and len(value.convert("L").getcolors()) > 20
    costs, error = shown[4], shown[-1]
    assert costs["brute-force"] == len(rt.load_scene("cornell")) > 2 * costs["kd-restart"]
    assert error < 1e-5


def test_the_tour_is_stored_without_outputs() -> None:
    assert TOUR.stat().st_size < 20_000
    for cell in CELLS:
        assert not cell.get("outputs") and cell.get("execution_count") is None


@pytest.mark.full
@pytest.mark.once
def test_the_tour_runs_in_a_kernel() -> None:
    nbclient = pytest.importorskip("nbclient", reason="no nbclient (extra: notebook)")
    nbformat = pytest.importorskip("nbformat", reason="no nbformat (extra: notebook)")
    pytest.importorskip("ipykernel", reason="no ipykernel (extra: notebook)")
    book = nbformat.read(TOUR, as_version=4)
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3").execute()
    data = [output["data"] for cell in book.cells if cell.cell_type == "code"
            for output in cell.outputs if output.output_type == "execute_result"]
    assert sum("text/html" in entry for entry in data) == 6
    assert sum("image/png" in entry for entry in data) == 2
