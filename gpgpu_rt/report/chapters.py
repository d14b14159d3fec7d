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
it draws. Ray tracing asks another question, which triangle does this ray meet first, and the
methods on this page are the answers that were found between 2002 and 2007.

Each is shown as it ran then. Everything that is measured here was measured by this program on the
renderer that a table names, and stands beside the number that the paper printed. Compare ratios
and orders, never times: what lies between the two columns is twenty years of hardware.
""", ("fig01",)),
    Chapter("A pass is a function over a stream (survey, section 2)", """
Put a ray into each texel of a texture. Draw one square over all of them, and the fragment program
runs once a ray: it reads the ray's state from one texture and writes the new state into another.
Then the two change places. There is no loop, no stack and no memory to write to but that one
texel; what a program of today does in a `while` is here a sequence of passes, and the host counts
by an occlusion query how many rays are still alive.

In the film each picture is a pass. On the left, what each ray waits for: a ray that has found its
hit is over, while its neighbour may still descend. The rays that wait longest decide when all are
through, and every pass that serves few of them is what the literal form costs.
""", ("fig02", "fig03", "schedules", "retention"), passes=("kd-restart",)),
    Chapter("Intersection alone on the card (survey, section 3.1)", """
The Ray Engine of 2002 left the search to the host. Rays were collected by the cell of space they
were in, and a triangle was drawn as a square over all rays of its cell, so that the rasteriser
made every pair of the two. The card tested fast; moving rays there and hits back took the time.
""", ("fig04", "fig05")),
    Chapter("Uniform grids (survey, section 3.3)", """
Purcell and his colleagues put the search itself on the card. Cut space into equal cells and list
the triangles in each: a ray walks from cell to cell, and which is next follows from three
additions. Two kernels are enough, *walk* and *intersect*.

Equal cells are right for a scene that fills space evenly. A teapot in a stadium is not one: cells
small enough for the teapot are far too many for the stadium. Proximity clouds let a ray jump over
what is empty, but not over what is crowded.
""", ("fig06", "fig07", "fig08"), passes=("grid",)),
    Chapter("kd-trees without a stack (survey, section 3.4)", """
A tree of splitting planes is fine where the scene is and coarse where nothing is. On a CPU a ray
that leaves a leaf pops the next node from its stack; a fragment program had none. Five ways out
are compared here:

* **restart**: shorten the ray by what it has passed and begin at the root again;
* **backtrack**: climb to parents, which then need boxes;
* **push-down**: restart at the last node that holds all that is left of the ray;
* **short stack**: a stack of three entries in registers, and a restart when it runs dry;
* **ropes**: leaves that know their neighbours, so that no ray ever goes up.

They visit the same leaves in the same order. What differs is how many nodes they fetch between
them.
""", ("fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig15", "fig16", "fig17"),
        heat=("kd-restart", "kd-backtrack", "kd-short-stack")),
    Chapter("Bounding volumes (survey, section 3.5)", """
A hierarchy of boxes holds every triangle once. Its boxes may overlap, so a ray may have to look
into both children; but stored in depth-first order, with an index to where each subtree ends, the
tree is walked by one number a ray: *down* is the next node, *skip* is that index. No stack, no
restart, and the smallest state of all. What it gives up is the order: a tree threaded once is
walked the same way from every side, and eight copies, one for each octant of directions, bring
the order back.

A geometry image needs no tree at all. Where a surface is an image of its positions, the pyramid of
minima and maxima over that image is the hierarchy, and a few passes make it.
""", ("fig18", "fig19", "fig20", "fig21", "fig22"), passes=("bvh-threaded",),
        heat=("grid", "kd-restart", "bvh-threaded")),
    Chapter("Hierarchies over rays, not triangles", """
One may also turn the question round: put cones around bundles of rays and ask of each triangle
which of them it can meet. Nothing has to be built over the triangles, so nothing is lost when
they move. But the pairs of triangle and cone are many, and what is empty must be taken out of the
stream after each level. Stream reduction by blocks is what remained of the idea.
""", ("fig23", "fig24", "fig25", "reduction", "ray_space")),
    Chapter("Rays that keep together (survey, section 4)", """
Fetching a node is what costs, and neighbouring rays fetch the same ones. A packet fetches it once
for all its rays, as long as they go the same way. Sorted rays are neighbours again after they were
scattered; beams that go ahead find where the rays of a whole tile can begin. Each of these buys
something, and has a price that is measured with it.
""", ("cpu", "simd_width", "stacks", "ray_sorting", "entry_points")),
    Chapter("What rasterisation can do better (survey, section 5)", """
What the eye sees first needs no ray: the rasteriser finds it. But its answer is the nearest *pixel
centre by depth*, in other arithmetic than the ray's. Here each such hit is verified by the ray's
own test, and the rays in doubt are traced. The picture is the same to the bit.
""", ("rasterised", "refraction", "ray_bundles", "caustics")),
    Chapter("What moves, and what a scene needs", """
A structure is built once for a scene that stands still, and again and again for one that does not.
Boxes can be fitted anew in a known tree; planes of a kd-tree cannot. And a renderer that knows its
scene leaves out what it does not show.
""", ("frames", "needs", "path_noise")),
    Chapter("Speed against accuracy", """
The cards of the time computed in 24 bits or 16, and their rays slipped between triangles.
Precision is a choice that is paid for in wrong pixels or in time, and both can be counted. A
*leak* is a ray that passes a closed surface; a *wrong* ray has another triangle than the exact
one, beyond what the precision excuses. None among n rays proves only that at most 3/n are wrong.
""", ("tradeoff", "extremes")),
    Chapter("All of them side by side (survey, section 4)", """
The survey ends in one table: which structure, built where, walked how, and how many times faster
than the Ray Engine. Numbers of different papers, cards and scenes stand in it in one column, and
it says so. Here the same methods run on one scene, one renderer and the same rays.
""", ("table1", "fig26")),
    Chapter("Period hardware", """
How long would these programs have taken on the cards of their papers? The programs are run
through an emulated fragment processor, their instructions and fetches counted, and a time
predicted from what a card's data sheet says. One constant a card is fitted; the rest is
arithmetic.
""", ("period", "ideal_hardware")),
)
