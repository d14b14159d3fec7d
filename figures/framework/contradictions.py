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
                  "primary rays, below the 38.3 of plain restart. Shadow rays show no dip (34.8 "
                  "and 35.3), and push-down then reaches 88.8. Either push-down undoes a penalty, "
                  "or 17.5 is a misprint."),
    Contradiction(("fig12", "fig13", "fig20"), "The tables list scenes in different orders. "
                  "Figure 20's caption says that its scenes are Foley's, but Cows is not in "
                  "Figure 12."),
    Contradiction(("fig12", "fig20", "period"), "The grid on robots takes 8344 ms in Figure 12 "
                  "and 4626 ms in Figure 20. Yet Figure 20's card is slower in every other cell "
                  "that both figures have. The grids probably differed in resolution."),
    Contradiction(("fig08", "fig12"), "\"Up to 8 times faster than the uniform grid\" holds for "
                  "robots alone; by the same table the grid is faster on cornell and bunny."),
    Contradiction(("cpu",), "Section 4.2 scales 35.5 Mrays/s from 6.4 to 345.6 GFLOP/s and prints "
                  "1.887 billion rays a second; the product is 1.917. 6.4 seems to be the "
                  "Pentium 4's double precision, but 345.6 the GeForce's single precision. \"2 "
                  "threads with hyperthreading\" become \"two CPU cores\". 16.2 \"million rays "
                  "per second\" are the frames per second that Figure 22 prints in parentheses "
                  "(17.0 million rays)."),
    Contradiction(("stacks",), "Section 4.3 counts 64 stacks of 256 bytes in a G80's 16 KiB and "
                  "128 processes in parallel. But each multiprocessor has its own 16 KiB, and 128 "
                  "counts the processes of all multiprocessors together."),
    Contradiction(("table1",), "The text says that Zhou's kd-tree build goes breadth-first and "
                  "then depth-first. Zhou's abstract says breadth-first throughout."),
    Contradiction(("fig13",), "The survey says that the short stack falls back when it overflows, "
                  "and that push-down backtracks. In fact the short stack falls back when it runs "
                  "empty, and push-down restarts."),
    Contradiction(("fig15", "fig17"), "The survey says that each node stores six ropes. The sizes "
                  "in Figure 17 are right only if leaves alone store ropes."),
    Contradiction(("fig22",), "The survey describes Lauterbach's LBVH as clustering from below. "
                  "In fact it splits sorted Morton codes by their bits."),
    Contradiction(("ray_space",), "The survey describes ray classification as a uniform grid over "
                  "five dimensions, but its paper divides on demand. The visibility field's paper "
                  "compares itself with coherent single rays, not with packets."),
    Contradiction(("ideal_hardware",), "SaarCOR covers the whole pipeline, not intersections "
                  "alone, and its numbers of 2002 are simulated. The RPU renders 5.5 frames/s of "
                  "the conference room. It does not follow that the RPU is 50 to 100 times as "
                  "fast as graphics hardware."),
    Contradiction(("fig26", "table1"), "Packets \"generally outperform\" single rays, but Budge's "
                  "single rays lead the table (68.6). The survey calls almost all methods "
                  "\"computation-bounded\", but also argues with bandwidth. It lists Horn as "
                  "stack-based, though Horn's short stack falls back on restarts. It lists "
                  "Carr et al. 2002 without a structure, though their paper has one on the host."),
    Contradiction(("fig07",), "No GeForce 6800 GTX seems to have been sold. The thesis's own "
                  "abstract says that no version of its ray tracer beat the commercial renderer."),
    Contradiction(("fig13", "fig16", "fig22", "cpu"), "The survey gives three triangle counts for "
                  "the conference room: 282,801, 282,641 and 274 thousand."),
    Contradiction(("fig10",), "The pseudocode of Figure 10 descends into the first child where "
                  "t_hit < 0, though it orders children by the direction's sign. A ray that "
                  "starts behind the plane would then descend into the wrong child first."),
)


def of_page(name: str) -> list[str]:
    """The sentences that belong on the page ``name``."""
    return [one.says for one in CONTRADICTIONS if name in one.pages]
