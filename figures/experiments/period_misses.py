"""Period misses: sentences on the predictions for period hardware that miss published times.

They give the counts behind each miss, and reasons that several misses share.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from ..framework.comparison import Panel
from ..framework.kendall import tau_b
from ..framework.output import number
from ..framework.published_numbers import published_triangles
from .period_work import image_scale

if TYPE_CHECKING:
    from .period import PredictedCell

TIE = 0.05     # published times within this share of each other have no order, as in `tau_b`
FACTOR = 2     # a prediction that is off by more than this factor is a miss


def tau_of(found: list[PredictedCell], figure: str, panel: Panel) -> tuple[float, int]:
    """Return tau-b of predicted and published times on a panel, and the number of its methods."""
    mine = [row for row in found if row.experiment.figure.name == figure and row.panel == panel]
    return tau_b([r.ns for r in mine], [r.published for r in mine]), len(mine)


def turned_round(found: list[PredictedCell], bar: float) -> list[str]:
    """A sentence for each scored scene whose tau-b is below ``bar``.

    It names the pairs of methods that are predicted in the wrong order, with their counts.
    """
    lines = []
    for name, panel in dict.fromkeys((r.experiment.figure.name, r.panel) for r in found
                                     if r.scored):
        mine = [r for r in found if r.experiment.figure.name == name and r.panel == panel]
        tau, _ = tau_of(found, name, panel)
        if tau >= bar or tau != tau:
            continue
        pairs = [(one, other) for one in mine for other in mine
                 if one.published < (1 - TIE) * other.published and one.ns > other.ns]
        lines.append(f"{name}, {panel.label} (tau-b {number(tau, 2)}): " + "; ".join(
            f"{one.column.label} is published as {number(other.published / one.published)} times "
            f"as fast as {other.column.label} but predicted {number(one.ns / other.ns)} times as "
            f"slow ({_counts(one)}, against {_counts(other)})" for one, other in pairs) + ".")
    return lines


def missed(found: list[PredictedCell]) -> list[PredictedCell]:
    """Scored cells whose predictions are off by more than FACTOR, the farthest first."""
    return sorted((r for r in found if r.scored and not 1 / FACTOR <= r.ratio <= FACTOR),
                  key=lambda r: -abs(math.log2(r.ratio)))


def miss(row: PredictedCell) -> str:
    """Sentences on a missed cell: its counts, and the instructions that the time allows."""
    scale = image_scale(row.works[0][1])
    return (f"{row.experiment.figure.name}, {row.panel.label}, {row.column.label}: predicted "
            f"{number(row.ratio)} times the published time, bound by "
            f"{row.prediction.bound if row.prediction else '?'}. The published time allows "
            f"{number(_allowed(row))} instructions a ray at the card's peak; "
            f"{_counts(row)} were counted"
            + (f". The image's rays take {number(scale)} times the steps of its tiles' rays"
               if scale != 1 else "") + ".")


def other_editions(found: list[PredictedCell]) -> list[str]:
    """Sentences on scenes whose number of triangles is not the paper's."""
    counts = {row.panel.scene: (row.triangles,
                                published_triangles(row.experiment.figure.name, row.panel.scene))
              for row in found if not row.stand_in}
    return [f"{scene} is another edition of the model, with {ours:,} triangles instead of "
            f"{theirs:,}."
            for scene, (ours, theirs) in counts.items() if theirs and ours != theirs]


def reasons(found: list[PredictedCell]) -> list[str]:
    """Sentences on the common reasons of misses and wrong orders, as far as these occur."""
    return [says for reason in _REASONS for says in reason(found)]


def _allowed(row: PredictedCell) -> float:
    """Instructions per ray that the published time allows at the card's peak."""
    card = row.experiment.card
    return 1e-9 * row.published * (card.scalar_rate if card.scalar_units else card.vector_rate)


def _counts(row: PredictedCell) -> str:
    """A clause on the counted instructions of a ray (in a picture, of a pixel), and used lanes."""
    return (f"{number(row.instructions)} instructions with {100 * row.utilisation:.0f} % of the "
            "lanes used")


def _of(found: list[PredictedCell], figure: str,
        is_one: Callable[[PredictedCell], bool] = lambda row: True) -> list[PredictedCell]:
    return [row for row in found if row.scored and row.experiment.figure.name == figure
            and is_one(row)]


def _named(rows: list[PredictedCell]) -> str:
    return ", ".join(f"{row.panel.label} {row.column.label} {number(row.ratio)}" for row in rows)


def _brute_force(found: list[PredictedCell]) -> Iterable[str]:
    rows = _of(found, "fig12", lambda row: row.column.method == "brute-force")
    cost = max((kernel["vector"] for row in rows for _, work in row.works
                for kernel in work.get("kernels", ())), default=0)
    far = [row for row in missed(rows) if row.ratio > 1]
    if far and cost:
        yield ("Brute force in Figure 12: at the card's peak the published time allows "
               + ", ".join(f"{number(_allowed(row) / row.triangles)} instructions per test on "
                           f"{row.panel.scene}" for row in rows)
               + f". Our test takes {number(cost)} instructions as a pass of its own, which "
               "fetches and stores the state. No triangle test is as short as the published time "
               "requires, so the paper's passes must have done something else. The prediction is "
               "left as it is.")


def _few_triangles(found: list[PredictedCell]) -> Iterable[str]:
    rows = _of(found, "fig12", lambda row: row.panel.scene == "cornell"
               and row.column.method != "brute-force")
    if len(rows) > 1:
        ours, theirs = ([getattr(row, name) for row in rows] for name in ("ns", "published"))
        yield ("Figure 12 on cornell, without brute force: the slowest method is predicted to "
               f"take {number(max(ours) / min(ours))} times as long as the fastest, while "
               f"{number(max(theirs) / min(theirs))} times are published. The box has "
               f"{rows[0].triangles} triangles, so the work that each ray does only once decides "
               "the time.")


def _slow_trees(found: list[PredictedCell]) -> Iterable[str]:
    for scene in dict.fromkeys(row.panel.scene for row in _of(found, "fig20")):
        rows = {row.column.method: row for row in _of(
            found, "fig20", lambda row: row.panel.scene == scene)}
        kd, bvh = rows.get("kd-restart"), rows.get("bvh-threaded")
        if kd and bvh and kd.published > (1 + TIE) * bvh.published and kd.ns < bvh.ns:
            yield (f"Figure 20 on {scene}: the thesis's kd-tree takes "
                   f"{number(kd.published / bvh.published)} times its hierarchy's time. Ours is "
                   f"predicted to take {number(kd.ns / bvh.ns)} times, with "
                   f"{number(kd.instructions)} and {number(bvh.instructions)} instructions. The "
                   "thesis's tree was probably not built by a surface area heuristic; the survey "
                   "does not say how it was built.")


def _squares(found: list[PredictedCell]) -> Iterable[str]:
    far = [row for row in missed(_of(found, "fig20")) if row.ratio > 1]
    if far:
        yield (f"Figure 20 is predicted too slow ({_named(far)} times the published time): 1024 "
               "pixels branch together, so the slowest ray of a square decides. The emulated "
               "squares lie where rays differ most, and their waiting is assumed for all squares.")


def _climbing(found: list[PredictedCell]) -> Iterable[str]:
    rows = {(row.panel.scene, row.column.method): row for row in _of(found, "fig12")}
    for (scene, method), row in rows.items():
        restart = rows.get((scene, "kd-restart"))
        if method == "kd-backtrack" and restart and row.ratio < 1 / FACTOR:
            yield (f"kd-backtrack in Figure 12 is predicted too fast on {scene}: our method "
                   "climbs from a leaf in kernels of few instructions and takes "
                   f"{number(row.instructions / restart.instructions)} times kd-restart's "
                   "instructions, while the paper's took "
                   f"{number(row.published / restart.published)} times its time.")


def _shadows(found: list[PredictedCell]) -> Iterable[str]:
    far = [row for row in missed(_of(found, "fig13", lambda row: row.panel.rays == "shadow"))
           if row.ratio > 1]
    if far:
        yield (f"Shadow rays in Figure 13 are predicted too slow ({_named(far)} times the "
               "published time): this program chooses where the light is, and few pixels of a "
               "group have a shadow ray.")


def _secondary(found: list[PredictedCell]) -> Iterable[str]:
    for panel in dict.fromkeys(row.panel for row in _of(found, "fig16")
                               if "secondary" in (row.panel.rays or "")):
        rows = _of(found, "fig16", lambda row: row.panel == panel)
        times = [row.ns for row in rows]
        if len(rows) > 1 and tau_of(found, "fig16", panel)[0] < 1:
            yield (f"{panel.label} in Figure 16: all methods are predicted within "
                   f"{100 * (max(times) / min(times) - 1):.0f} % of each other, and the paper's "
                   "secondary rays are not known.")


_REASONS = (_brute_force, _few_triangles, _slow_trees, _squares, _climbing, _shadows, _secondary)
