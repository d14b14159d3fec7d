"""Contradictions: lists where the survey contradicts itself or its sources, by page."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Contradiction:
    """Sentences on a contradiction, and the figures whose pages show these sentences."""

    pages: tuple[str, ...]
    says: str


CONTRADICTIONS = (
    Contradiction(("fig13",), "For primary rays on cornell, Figure 13 prints 38.3 "
                  "Mrays/s for kd-restart with single rays, but only 17.5 for kd-restart with "
                  "packets. For shadow rays the two rates are nearly equal (34.8 and 35.3), and "
                  "packets with push-down reach 88.8 on the primary rays. Either packets without "
                  "push-down are slow on these rays, or 17.5 is a misprint."),
    Contradiction(("fig12", "fig13", "fig20"), "Figures 12, 13 and 20 list the scenes in "
                  "different orders. Figure 20's caption says that its scenes are Foley's, but "
                  "Cows is not in Figure 12, which has Foley's scenes."),
    Contradiction(("fig12", "fig20"), "The grid on robots takes 8344 ms in Figure 12 "
                  "and 4626 ms in Figure 20. Yet Figure 20's card is slower in every other "
                  "number that both figures have. The grids probably differed in resolution."),
    Contradiction(("fig08", "fig12"), "The survey calls kd-trees \"up to 8 times faster than the "
                  "uniform grid\". By Figure 12 this is true only of robots, and the grid is "
                  "faster than the kd-trees on cornell and bunny."),
    Contradiction(("cpu",), "Section 4.2 scales 35.5 Mrays/s from 6.4 to 345.6 GFLOP/s and prints "
                  "1.887 billion rays a second; the product is 1.917. The 6.4 GFLOP/s seem to be "
                  "the Pentium 4's peak in double precision, but the 345.6 GFLOP/s are the "
                  "GeForce's peak in single precision. The survey first gives this CPU \"2 "
                  "threads with hyperthreading\" and later \"two CPU cores\". The 16.2 \"million "
                  "rays per second\" are in fact frames per second: Figure 22 prints 16.2 in "
                  "parentheses. 16.2 frames per second are 17.0 million rays per second."),
    Contradiction(("stacks",), "Section 4.3 counts 64 stacks of 256 bytes in a G80's 16 KiB and "
                  "128 processes in parallel. But each multiprocessor has its own 16 KiB, and 128 "
                  "counts the processes of all multiprocessors together."),
    Contradiction(("table1",), "The text says that Zhou's kd-tree build goes breadth-first and "
                  "then depth-first. Zhou's abstract says breadth-first throughout."),
    Contradiction(("fig13",), "The survey says that a ray with a short stack restarts when the "
                  "stack overflows, and that push-down backtracks. In fact the ray restarts when "
                  "the stack runs empty, and push-down restarts too."),
    Contradiction(("fig15", "fig17"), "The survey says that each node stores six ropes. The sizes "
                  "in Figure 17 are right only if inner nodes store none."),
    Contradiction(("fig22",), "The survey describes Lauterbach's LBVH as clustering bottom-up. "
                  "In fact the LBVH splits sorted Morton codes by their bits, top-down."),
    Contradiction(("ray_space",), "The survey describes ray classification as a uniform grid over "
                  "five dimensions, but the paper on ray classification divides on demand. The "
                  "survey compares the visibility field with packets; the paper on the field "
                  "compares the field with coherent single rays."),
    Contradiction(("ideal_hardware",), "The survey describes SaarCOR as hardware for "
                  "intersections, but SaarCOR covers the whole pipeline, and its numbers of 2002 "
                  "are simulated. The survey calls the RPU 50 to 100 times as fast as graphics "
                  "hardware. This does not follow from the RPU's 5.5 frames/s on the conference "
                  "room."),
    Contradiction(("fig26", "table1"), "The survey says that packets \"generally outperform\" "
                  "single rays, but Budge's single rays lead Table 1 (68.6 times the speed of the "
                  "Ray Engine). The survey calls almost all methods "
                  "\"computation-bounded\", but also argues with bandwidth. It lists Horn as "
                  "stack-based, though Horn's short stack falls back on restarts. It lists "
                  "Carr et al. 2002 without a structure, though their host has a structure."),
    Contradiction(("fig07",), "The survey names a GeForce 6800 GTX, but no such card seems to "
                  "have been sold. By the survey's times the grid on this card was faster than a "
                  "commercial renderer. But the times are from the thesis of Karlsson and "
                  "Ljungstedt (2004), whose abstract says that no version of its ray tracer was "
                  "faster."),
    Contradiction(("fig13", "fig16", "fig22", "cpu"), "The survey gives three triangle counts for "
                  "the conference room: 282,801, 282,641 and 274 thousand."),
    Contradiction(("fig10",), "The pseudocode of Figure 10 orders the children by the direction's "
                  "sign. If t_hit < 0, the plane lies behind the ray's origin, so only the second "
                  "child lies ahead of the ray. But the pseudocode then descends into the first "
                  "child."),
)


def of_page(name: str) -> list[str]:
    """The sentences that belong on the page ``name``."""
    return [one.says for one in CONTRADICTIONS if name in one.pages]
