"""Period notes: what a reader of the predictions must know about the published numbers."""
from __future__ import annotations

# Figure 22 repeats Popov's numbers of Figure 16.
TWICE_PRINTED = {("fig22", "kd-ropes-packet")}

NOTES = {
    "fig12": (
        "The survey does not name the card; the Radeon X800 XT PE is an assumption. It has no "
        "branches, so each kernel is a pass of its own, which reads and writes the whole state.",),
    "fig16": (
        "A packet is a warp in the paper, a ray a lane. Ours of 4x4 rays come nearest: their work "
        "is spread over as many lanes, and two of them make a warp. Lanes used are then those of "
        "whole packets: rays that a packet carries along count.",
        "Which secondary rays were traced the survey does not say: a shadow ray a hit is "
        "counted.",),
    "fig20": (
        "The thesis's loop takes one step a turn, whatever a ray wants, and is emulated so; where "
        "1024 pixels branch alike, a loop within for each kernel makes all wait for the slowest "
        "ray in each.",
        "Which rays an image has the survey does not say: eye rays and a shadow ray a hit are "
        "counted. The grids' resolution is Figure 12's.",),
    "fig22": (
        "Of the two figures for bvh-packet's eye rays the first one is taken; what the one in "
        "parentheses stands for the survey does not say. kd-ropes-packet repeats Figure 16 and "
        "is scored there.",),
}
