"""Period notes: what a reader of the predictions must know about the published numbers."""
from __future__ import annotations

# Figure 22 repeats Popov's numbers of Figure 16.
TWICE_PRINTED = {("fig22", "kd-ropes-packet")}

NOTES = {
    "fig12": (
        "The survey does not name the card; the Radeon X800 XT PE is an assumption. This card has "
        "no branches, so each kernel is a pass of its own, which reads and writes the whole "
        "state.",),
    "fig16": (
        "In the paper a packet is a warp, with a ray per lane. Our packets of 4x4 rays are the "
        "nearest form: their work is divided among as many lanes, and two packets make a warp. "
        "The lanes used are then those of whole packets, which count every ray of a packet.",
        "The survey does not say which secondary rays were traced: a shadow ray per hit is "
        "counted.",),
    "fig20": (
        "The thesis's loop takes one step per iteration, whichever step a ray wants, and is "
        "emulated in this form. Where 1024 pixels branch together, an inner loop for each kernel "
        "would make all pixels wait for the slowest ray in each loop.",
        "The survey does not say which rays an image has: eye rays and a shadow ray per hit are "
        "counted. The grids' resolution is Figure 12's.",),
    "fig22": (
        "The survey prints two numbers for bvh-packet's eye rays, and the first is used; it does "
        "not say what the number in parentheses means. kd-ropes-packet repeats Figure 16 and is "
        "scored there.",),
}
