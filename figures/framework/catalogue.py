"""Catalogue: lists the survey's figures and tables, and this program's further experiments."""
from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from .. import experiments, survey

# Name -> title. A figure of the survey is a module in ``survey/`` whose file name begins with the
# figure's name. An experiment is a module in ``experiments/`` with the experiment's name.
FIGURES = {
    "fig01": "Figure 1: reflections, soft shadows, refraction",
    "fig02": "Figure 2: the shader pipeline, as a pass of this program goes through it",
    "fig03": "Figure 3: a pass as stream processing",
    "fig04": "Figure 4: the organisation of the Ray Engine",
    "fig05": "Figure 5: a picture by the Ray Engine, and where the time goes",
    "fig06": "Figure 6: ray tracing in a grid as streams and kernels",
    "fig07": "Figure 7: a picture by the grid with proximity clouds",
    "fig08": "Figure 8: a teapot in a stadium",
    "fig09": "Figure 9: a kd-tree, and its nodes",
    "fig10": "Figure 10: the traversal of a kd-tree, step by step",
    "fig11": "Figure 11: kd-restart against kd-backtrack",
    "fig12": "Figure 12: eye rays by brute force, grid and kd-trees",
    "fig13": "Figure 13: restart, packets, push-down, short stack",
    "fig14": "Figure 14: mirrors upon mirrors, with and without packets",
    "fig15": "Figure 15: a kd-tree with ropes",
    "fig16": "Figure 16: ropes for single rays and packets",
    "fig17": "Figure 17: what ropes add to a kd-tree's size",
    "fig18": "Figure 18: a bounding volume hierarchy of boxes",
    "fig19": "Figure 19: the same hierarchy, threaded",
    "fig20": "Figure 20: whole images by grid, kd-trees and threaded BVHs",
    "fig21": "Figure 21: a geometry image, and the pyramids over it",
    "fig22": "Figure 22: packets over a BVH and along ropes, also in very large scenes",
    "fig23": "Figure 23: the hierarchical ray engine, tiles of rays against triangles",
    "fig24": "Figure 24: the hierarchy of cones over rays",
    "fig25": "Figure 25: the traversal of a ray hierarchy",
    "fig26": "Figure 26: every method at 10,000 triangles, relative to the Ray Engine",
    "table1": "Table 1: properties of the methods",
    "cpu": "Ray tracing on the CPU: rays per second and per GFLOP (section 4.2)",
    "entry_points": "Entry points and rasterised bounds",
    "era_machine": "The papers' cards: times predicted without fitted constants",
    "era_numbers": "Number formats of the papers' cards: the rays that fixed point and fp24 lose",
    "retention": "Data retention: bytes that passes move because no pass keeps data for the next",
    "simd_width": "Wide SIMD: how long incoherent rays wait for each other",
    "stacks": "Stack against stackless: the number of rays in flight",
    "ideal_hardware": "Hardware for rays: triangle and traversal units, explicit transfers",
    "ray_sorting": "Ray sorting: its cost, its gain, and the coherence of rays",
    "rasterised": "First hits from the rasteriser: the cost of proving them",
    "refraction": "Refraction by two passes of the rasteriser, compared with rays in float64",
    "caustics": "Caustics mapping, compared with traced photons",
    "ray_bundles": "Ray bundles by peeled projections, compared with traced bundles and paths",
    "frames": "Moving scenes: time per frame with refitted trees, rebuilt trees and kd-trees",
    "needs": "What a scene needs: renderers derived from ten scenes, or one renderer for all",
    "path_noise": "Path tracing: error by number of samples, with Sobol' and with random numbers",
    "reduction": "Stream reduction by blocks, compared with a scan",
    "ray_space": "Tables over rays: ray classification and the visibility field",
    "schedules": "The three schedules: a pass for each kernel, for each step, or for all steps",
    "extremes": "Extreme scenes and rays: the errors of each method, and whether all rays end",
    "conformance": "Conformance: this project and today's ray tracers against exact answers",
    "tradeoff": "Speed against accuracy: precision, intersection tests, intervals",
}


def figure_of(name: str) -> Any:
    """Return the `Comparison` FIGURE of a figure's module, or the module if it has no FIGURE.

    The result has ``cells(full)`` and ``draw(data, out, full)``. ``draw`` writes out/NAME.csv, .md
    and .png. A measured figure also has ``judge(data, full)``, from which pages.py gets the
    figure's verdict.
    """
    folder = survey if of_survey(name) else experiments
    found = next(module.name for module in iter_modules(folder.__path__)
                 if module.name == name or of_survey(name) and module.name.startswith(name + "_"))
    module = import_module(f"{folder.__name__}.{found}")
    return getattr(module, "FIGURE", module)


def of_survey(name: str) -> bool:
    """Return whether ``name`` is one of the survey's own figures and tables."""
    return name.startswith(("fig", "table"))
