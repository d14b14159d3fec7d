"""The chapters of the page in the survey's order, each with its text and its figures."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Chapter:
    """A chapter of the page.

    Attributes
    ----------
    title : the title, with the section of the survey if there is one
    text : the text in Markdown
    figures : names of ``python -m gpgpu_rt.figures``, in the order of the page
    passes : methods whose passes are shown as a film
    heat : methods whose cost per pixel is shown as heat maps on a common scale
    """

    title: str
    text: str
    figures: tuple[str, ...] = ()
    passes: tuple[str, ...] = ()
    heat: tuple[str, ...] = ()


CHAPTERS = (
    Chapter("Rays on a machine made for triangles", """
A graphics card of 2002 could do one thing fast: run a short program on every pixel of a triangle
that it draws. Ray tracing asks another question: which triangle does a ray hit first? The methods
on this page are the answers that were found between 2002 and 2007.

Each method runs here by the algorithm of its paper. This program measured the method's times on
the renderer that the table names. The number from the paper stands beside the measured time.
Compare ratios and rankings, not times: twenty years of hardware lie between the two numbers. Where
a paper measured on a card, a third number is the time that a model predicts for this card.
""", ("fig01",)),
    Chapter("A pass is a function over a stream (survey, section 2)", """
Store a ray in each texel of a texture. Draw a square over all texels, and the fragment program
runs once per ray: it reads the state of the ray from one texture and writes the new state to
another. Then the two textures swap. There is no loop and no stack, and a program can write only to
its own texel. Where a program of today has a `while` loop, the card runs a sequence of passes, and
the host counts the live rays by an occlusion query.

In the film, each picture shows a pass. The left side shows the kernel that each ray waits for. A
ray that has found its hit is finished, while its neighbour may still descend. The slowest rays
decide the number of passes. Therefore many passes advance only a few rays; this is the price of
tracing in passes.
""", ("fig02", "fig03", "schedules", "retention"), passes=("kd-restart",)),
    Chapter("Intersection alone on the card (survey, section 3.1)", """
The Ray Engine of 2002 left the search to the host. The host collected the rays in each cell of
space. The card then drew each triangle as a square over all rays of its cell, so the rasteriser
generated every pair of a ray and a triangle. The tests on the card were fast; most of the time
went into copying rays to the card and hits back.
""", ("fig04", "fig05")),
    Chapter("Uniform grids (survey, section 3.3)", """
Purcell and his colleagues moved the search itself to the card. Divide space into equal cells and
list the triangles in each cell. A ray walks from cell to cell, and three additions find the next
cell. Two kernels are enough: *walk* and *intersect*.

Equal cells suit a scene that fills space evenly. A teapot in a stadium does not: cells that are
small enough for the teapot are far too many for the stadium. Proximity clouds let a ray jump over
empty cells, but not over crowded cells.
""", ("fig06", "fig07", "fig08"), passes=("grid",)),
    Chapter("kd-trees without a stack (survey, section 3.4)", """
A tree of splitting planes has small cells around triangles and large cells in empty space. On a
CPU, a ray that leaves a leaf pops the next node from its stack; a fragment program had no stack.
Five alternatives are compared here:

* **restart**: cut off the part of the ray that was searched, and begin at the root again;
* **backtrack**: climb to the parents, and test the box of each parent;
* **push-down**: restart at the last node that contains the whole rest of the ray;
* **short stack**: a stack of three entries in registers, and a restart when it is empty;
* **ropes**: links from each leaf to its neighbours, so that no ray goes up.

They visit the same leaves in the same order. They differ in the number of nodes that they fetch
between two leaves.
""", ("fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig15", "fig16", "fig17"),
        heat=("kd-restart", "kd-backtrack", "kd-short-stack")),
    Chapter("Bounding volumes (survey, section 3.5)", """
A hierarchy of boxes holds every triangle once. Its boxes may overlap, so a ray may have to visit
both children. The nodes are stored in depth-first order, and each node has the index of the end of
its subtree. A ray then needs only one number: it descends to the next node, or skips to that
index. This method needs no stack and no restart, and the state of its rays is smaller than in the
kd-tree methods. Its disadvantage is the order: rays from all sides visit the nodes in the same
order. Eight copies of the tree, one for each octant of directions, restore the front-to-back
order.

A geometry image needs no tree. The surface is stored as an image of its positions. The pyramid of
minima and maxima over this image is the hierarchy, and a few passes build it.
""", ("fig18", "fig19", "fig20", "fig21", "fig22"), passes=("bvh-threaded",),
        heat=("grid", "kd-restart", "bvh-threaded")),
    Chapter("Hierarchies over rays, not triangles", """
The search can also be reversed: put cones around bundles of rays, and find for each triangle the
cones that it can intersect. No structure is built over the triangles, so moving triangles cost
nothing extra. But there are many pairs of a triangle and a cone. After each level of the
hierarchy, the pairs whose triangle misses the cone must be removed from the stream. Later work
used only one part of this method, the stream reduction by blocks.
""", ("fig23", "fig24", "fig25", "reduction", "ray_space")),
    Chapter("Rays that keep together (survey, section 4)", """
Fetching nodes is the main cost, and neighbouring rays fetch the same nodes. A packet fetches a
node once for all its rays, as long as the rays take the same path. Sorting makes scattered rays
neighbours again. Beams find entry points in the tree for all rays of a tile. Each of these ideas
has a gain and a cost, and both are measured here.
""", ("cpu", "simd_width", "stacks", "ray_sorting", "entry_points")),
    Chapter("What rasterisation can do better (survey, section 5)", """
The first hit of an eye ray needs no ray tracing: the rasteriser finds it. But the rasteriser
compares *depths at pixel centres*, and its arithmetic differs from the arithmetic of rays. Here
the ray's own test verifies each hit of the rasteriser, and a ray is traced if its hit cannot be
proved. The picture is the same to the bit.
""", ("rasterised", "refraction", "ray_bundles", "caustics")),
    Chapter("What moves, and what a scene needs", """
A static scene needs its structure only once; a moving scene needs a new or a changed structure for
every frame. The boxes of a known tree can be refitted to moved triangles, but the planes of a
kd-tree cannot. A renderer that knows its scene can also leave out every feature that the scene
does not use.
""", ("frames", "needs", "path_noise")),
    Chapter("Speed against accuracy", """
Many cards of the time computed with 24 or 16 bits, and their rays slipped between triangles. Low
precision costs wrong pixels, high precision costs time, and both costs can be measured. A *leak*
is a ray that passes through a closed surface. A *wrong* ray finds another triangle than the exact
answer, and its rounding errors do not explain the difference. If n random rays show no error, the
share of wrong rays is below 3/n, with a confidence of 95 %.

Ray tracers of today are compared with the same exact answers, on rays that are aimed at difficult
places.
""", ("tradeoff", "extremes", "conformance")),
    Chapter("All of them side by side (survey, section 4)", """
The survey ends with a table: the structure of each method, the device that builds it, the
traversal algorithm, and the speed relative to the Ray Engine. The survey notes that the column of
speeds mixes numbers of different papers, cards and scenes. Here the same methods run on one scene
and one renderer, with the same rays.
""", ("table1", "fig26")),
    Chapter("The graphics cards of the papers", """
How long would these programs have taken on the cards of their papers? Mesa still has compilers for
most of these cards, and these compilers compile the kernels. This program records which kernel
each ray runs in each step. The record shows how often a card issues a kernel, and how many pixels
wait meanwhile. A model predicts a time from these counts and from the numbers in a card's data
sheet. No constant is fitted.

The cards rounded each result to 9 or 16 bits of fixed point, or to floats of 24 or 32 bits. The
pictures show the rays that are lost by this rounding.
""", ("era_numbers", "era_machine", "ideal_hardware")),
)
