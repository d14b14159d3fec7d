"""Contradictions: where the survey contradicts itself or its sources, and the pages concerned."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Contradiction:
    """A sentence, and the names of the figures on whose pages it belongs."""

    pages: tuple[str, ...]
    says: str


CONTRADICTIONS = (
    Contradiction(("fig13", "period"), "Figure 13 prints packets at 17.5 Mrays/s on cornell's "
                  "primary rays, below plain restart's 38.3, while shadow rays show no dip (34.8 "
                  "and 35.3) and push-down then reaches 88.8. A "
                  "penalty that push-down undoes, or a misprint."),
    Contradiction(("fig12", "fig13", "fig20"), "The tables list scenes in different orders, and "
                  "Figure 20's caption says that its scenes are Foley's, though Cows is not in "
                  "Figure 12."),
    Contradiction(("fig12", "fig20", "period"), "The grid on robots takes 8344 ms in Figure 12 "
                  "and 4626 ms in Figure 20, on a card that is slower in every other cell that "
                  "both have: the grids probably differed in resolution."),
    Contradiction(("fig08", "fig12"), "\"Up to 8 times faster than the uniform grid\" holds for "
                  "robots alone; by the same table the grid is faster on cornell and bunny."),
    Contradiction(("cpu",), "Section 4.2 scales 35.5 Mrays/s from 6.4 to 345.6 GFLOP/s and comes "
                  "to 1.887 billion rays a second; the product is 1.917. 6.4 seems to be the "
                  "Pentium 4's double precision beside the GeForce's single. \"2 threads "
                  "with hyperthreading\" become \"two CPU cores\", and 16.2 \"million "
                  "rays per second\" are the frames a "
                  "second in parentheses of Figure 22 (17.0 million rays)."),
    Contradiction(("stacks",), "Section 4.3 counts 64 stacks of 256 bytes in a G80's 16 KiB and "
                  "128 processes in parallel; but 16 KiB is what each of its multiprocessors "
                  "has, and the 128 are of all of them together."),
    Contradiction(("table1",), "Of Zhou's kd-tree build the text says that it goes breadth-first "
                  "and then depth-first; its abstract says breadth-first throughout."),
    Contradiction(("fig13",), "The short stack is said to fall back when it overflows, and "
                  "push-down to backtrack: it is when it runs empty, and push-down restarts."),
    Contradiction(("fig15", "fig17"), "Six ropes are said to stand in each node; the sizes in "
                  "Figure 17 come out if they stand in leaves alone."),
    Contradiction(("fig22",), "Lauterbach's LBVH is described as clustering from below; it splits "
                  "sorted Morton codes by their bits."),
    Contradiction(("ray_space",), "Ray classification is described as a uniform grid over five "
                  "dimensions; its paper divides on demand. The visibility field's paper compares "
                  "itself with coherent single rays, not with packets."),
    Contradiction(("ideal_hardware",), "SaarCOR covers the whole pipeline, not intersections "
                  "alone, and its numbers of 2002 are simulated. That the RPU is 50 to 100 times "
                  "as fast as graphics hardware does not follow from its 5.5 frames/s on the "
                  "conference room."),
    Contradiction(("fig26", "table1"), "Packets \"generally outperform\" single rays, but Budge's "
                  "single rays lead the table (68.6); \"almost all methods are "
                  "computation-bounded\" stands beside arguments about bandwidth; Horn is listed "
                  "as stack-based, though its short stack falls back on restarts, and Carr 2002 "
                  "without a structure, though its paper has one on the host."),
    Contradiction(("fig07",), "No GeForce 6800 GTX seems to have been sold; and the thesis's own "
                  "abstract says that no version of it beat the commercial renderer."),
    Contradiction(("fig13", "fig16", "fig22", "cpu"), "The conference room has 282,801, 282,641 "
                  "or 274 thousand triangles, by the place in the survey."),
    Contradiction(("fig10",), "The pseudocode of Figure 10 sends t_hit < 0 to the first child, "
                  "though it orders children by the direction's sign: a ray that starts behind "
                  "the plane would then descend to the wrong child first."),
)


def of_page(name: str) -> list[str]:
    """The sentences that belong on the page ``name``."""
    return [one.says for one in CONTRADICTIONS if name in one.pages]
