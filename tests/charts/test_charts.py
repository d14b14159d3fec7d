"""Charts that are drawn with the shared helpers keep the rules of tests/chart_rules.py. The check
of these rules finds charts that break a rule."""
from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="no matplotlib (extra: figures)")

from chart_rules import faults  # noqa: E402  (needs matplotlib)
from matplotlib.text import Text  # noqa: E402
from PIL import Image  # noqa: E402

import gpgpu_rt as rt  # noqa: E402
from gpgpu_rt.charts import (  # noqa: E402
    COLOURS, FORMATS, MARKERS, Series, direct_labels, dot_rows, legend_of, linear_axis, log_axis,
    plain, plt, save
)

PACKAGE = Path(rt.__file__).parent
FIGURES = Path(rt.__file__).parents[1] / "figures"


@pytest.mark.parametrize("value, text", [
    (380, "380"), (1234567, "1,230,000"), (0.02, "0.02"), (87.26, "87.3"), (1e-9, "0.000000001"),
    (100, "100"), (0, "0"), (-12.5, "-12.5"), (999.6, "1,000"), (5e6, "5,000,000")])
def test_plain_numbers(value: float, text: str) -> None:
    assert plain(value) == text


@pytest.mark.parametrize("low, high", [
    (230, 390), (1, 1e6), (0.003, 0.7), (87.25, 90.1), (1e-7, 1e5), (9, 11),
    (1e-12, 1e12)])
@pytest.mark.parametrize("which", ["x", "y"])
def test_ticks_of_a_logarithmic_axis(low: float, high: float, which: str) -> None:
    figure, axis = plt.subplots()
    axis.plot(*((low, high), (1, 2))[::1 if which == "x" else -1], "o")
    log_axis(axis, which)
    figure.canvas.draw()
    one = getattr(axis, f"{which}axis")
    shown = [tick for tick in one.get_ticklocs() if low / 2 < tick < high * 2]
    assert 2 <= len(shown) <= 8
    assert faults(figure) == []
    plt.close(figure)


def _bars(axis: Any) -> None:
    axis.bar([0, 1], [361, 238])


def _on_a_log_axis(axis: Any) -> None:
    _bars(axis)
    axis.set_yscale("log")


def _lying_on_a_log_axis(axis: Any) -> None:
    axis.barh([0, 1], [361, 238])
    log_axis(axis, "x")


def _stacked_on_a_log_axis(axis: Any) -> None:
    _bars(axis)
    axis.bar([0, 1], [5, 6], bottom=[361, 238])
    log_axis(axis, "y")


def _histogram_on_a_log_axis(axis: Any) -> None:
    axis.hist([1, 2, 2, 3])
    log_axis(axis, "y")


def _without_zero(axis: Any) -> None:
    _bars(axis)
    axis.set_ylim(200, 400)


def _with_an_exponent(axis: Any) -> None:
    axis.plot([1, 1e9], [1, 2])


def _with_powers(axis: Any) -> None:
    axis.semilogx([1, 1e9], [1, 2])


def _not_round(axis: Any) -> None:
    axis.plot([0, 349], [0, 1])
    axis.set_xticks([0, 87.25, 174.5])


def _without_numbers(axis: Any) -> None:
    axis.plot([2, 3], [0, 1])
    log_axis(axis, "x")
    axis.set_xticks([], [])


def _with_many_entries(axis: Any) -> None:
    for k in range(18):
        axis.plot([0, 1], [0, k], label=f"method {k}")
    axis.legend()


def _with_a_title(axis: Any) -> None:
    axis.figure.suptitle("Figure 8: a teapot in a stadium")


@pytest.mark.parametrize("draw, says", [
    (_on_a_log_axis, "logarithmic y"), (_lying_on_a_log_axis, "logarithmic x"),
    (_stacked_on_a_log_axis, "logarithmic y"), (_histogram_on_a_log_axis, "logarithmic y"),
    (_without_zero, "without zero"), (_with_an_exponent, "multiplied by 1e9"),
    (_with_powers, "not a plain number"), (_not_round, "'174.5' is not round"),
    (_without_numbers, "0 numbers"), (_with_many_entries, "18 entries"),
    (_with_a_title, "has the title")])
def test_the_check_finds(draw: Callable[[Any], None], says: str) -> None:
    figure, axis = plt.subplots()
    draw(axis)
    assert any(says in fault for fault in faults(figure)), faults(figure)
    plt.close(figure)


def test_the_check_passes_bars_from_zero() -> None:
    figure, axis = plt.subplots()
    _bars(axis)
    linear_axis(axis, "y")
    assert faults(figure) == [] and axis.get_ylim()[0] == 0
    plt.close(figure)


def test_dots_lie_where_their_numbers_are() -> None:
    series = [Series("here", [361, 238, None], (COLOURS[0], MARKERS[0]), [(300, 400), None, None]),
              Series("published", [380.0, None, 12.5], (COLOURS[1], MARKERS[1])),
              Series("predicted", [None, None, None])]
    figure, axis = plt.subplots()
    dot_rows(axis, ["grid", "kd-restart", "bih"], series, "ns a ray (log)")
    assert faults(figure) == [] and axis.get_xscale() == "log"
    dots = sorted((round(line.get_ydata()[0]), float(line.get_xdata()[0]))
                  for line in axis.lines if line.get_marker() != "None")
    assert dots == [(0, 361), (0, 380), (1, 238), (2, 12.5)]
    assert {text.get_text() for text in axis.texts} == {"361", "380", "238", "12.5"}
    assert [one.get_label() for one in legend_of(series)] == ["here", "published"]
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in axis.texts]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[k + 1:])
    assert all(box.x1 <= figure.bbox.x1 for box in boxes)
    plt.close(figure)


def test_direct_labels_cover_nothing() -> None:
    """Labels of 40 points overlap neither each other nor a point. Most points lie on a line."""
    figure, axis = plt.subplots(figsize=(9, 7))
    points = [(1.1 ** k, 1.0 if k % 3 else 1.3 ** k, f"method-{k}") for k in range(40)]
    axis.plot([x for x, *_ in points], [y for _, y, _ in points], "o")
    log_axis(axis, "x")
    log_axis(axis, "y")
    written = direct_labels(axis, points)
    figure.canvas.draw()
    assert 35 <= written == len(axis.texts)
    boxes = [Text.get_window_extent(text) for text in axis.texts]      # without leader lines
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[k + 1:])
    for x, y, _ in points:
        place = axis.transData.transform((x, y))
        assert not any(box.contains(*place) for box in boxes)
    plt.close(figure)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_describes_its_chart(tmp_path: Path, suffix: str) -> None:
    figure, axis = plt.subplots()
    axis.plot([0, 1], [0, 1], label="grid")
    axis.set(xlabel="bounces", title="robots")
    axis.legend()
    save(figure, tmp_path / f"chart{suffix}", "Lines show the rate by the number of bounces")
    assert (tmp_path / f"chart{suffix}").stat().st_size > 1000
    if suffix == ".png":
        with Image.open(tmp_path / "chart.png") as image:
            assert image.info["Description"] == (
                "Lines show the rate by the number of bounces. Panels: robots. Axes: bounces. "
                "Series: grid.")


def test_every_chart_is_written_by_the_shared_helper() -> None:
    """No module writes a chart, or makes an axis logarithmic, without the shared helper, so the
    rules apply to every chart."""
    own = PACKAGE / "charts"
    for folder in (PACKAGE, FIGURES):
        for path in folder.rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if own in path.parents or "plt" not in text:
                continue
            calls = {node.func.attr for node in ast.walk(ast.parse(text))
                     if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)}
            assert not calls & {"savefig", "set_xscale", "set_yscale", "semilogx", "semilogy",
                                "loglog", "suptitle"}, path
            assert not re.search(r"[xy]scale=|log=True", text), path
