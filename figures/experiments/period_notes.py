"""Period notes: what a reader of the predictions must know about the published numbers."""
from __future__ import annotations

# Figure 22 repeats Popov's numbers of Figure 16.
TWICE_PRINTED = {("fig22", "kd-ropes-packet")}

NOTES = {
    "fig12": (
        "The survey does not name the card; the Radeon X800 XT PE is an assumption. The card "
        "cannot branch, so each kernel is a pass of its own, which reads and writes the whole "
        "state.",),
    "fig16": (
        "In the paper a packet is a warp, with a ray per lane. Our packets of 4x4 rays are the "
        "nearest form: their work is divided among as many lanes, and two packets make a warp. "
        "The column of lanes used then counts every ray of a working packet.",
        "The survey does not say which secondary rays were traced. A shadow ray per hit is "
        "counted here.",),
    "fig20": (
        "In the thesis an iteration of the loop runs one step of each ray, of whichever kernel "
        "the ray needs. The loop is emulated in this form. On the card 1024 pixels branch "
        "together, so an inner loop for each kernel would make all pixels wait for the slowest "
        "ray in each loop.",
        "The survey does not say which rays an image has. Eye rays and a shadow ray per hit are "
        "counted here. The grids have the resolutions of Figure 12.",),
    "fig22": (
        "The survey prints two numbers for bvh-packet's eye rays, of which the first is used; the "
        "survey does not say what the number in parentheses means. The numbers of kd-ropes-packet "
        "repeat Figure 16's and are scored there.",),
}
