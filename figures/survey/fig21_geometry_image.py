"""Figure 21: a mesh as a geometry image, and the pyramids over it."""
from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.methods.geometry_image.tree import ImageTree
from gpgpu_rt.scene.surfaces.parametrise import Parametrisation, parametrise

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text

SIZE, SHOWN = 64, (0, 2, 3, 4)     # SIZE: cells per side of the image; SHOWN: drawn levels
HEADS = ("level", "nodes", "cells a node", "mean longest side of a box / of the scene's box")


def cells(full: bool) -> list[Cell]:
    return []


def horned() -> trimesh.Trimesh:
    """A closed lump with two horns and a snout, as a mesh."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    at = mesh.vertices.copy()
    for way, length, width in (((0.5, 1.0, 0.3), 1.3, 9), ((-0.5, 1.0, 0.3), 1.3, 9),
                               ((0.0, -0.1, 1.0), 0.6, 4)):
        way = np.array(way) / np.linalg.norm(way)
        near = np.exp(-width * ((mesh.vertices - way) ** 2).sum(axis=1))
        at += length * near[:, None] * way
    mesh.vertices = at
    return mesh


@lru_cache(maxsize=1)
def surface() -> Parametrisation:
    return parametrise(horned(), SIZE)


@lru_cache(maxsize=1)
def pyramids() -> tuple[ImageTree, np.ndarray, np.ndarray]:
    """Return the tree, and its boxes' corners lo and hi, (nodes, 3) each, read from textures."""
    with rt.Tracer(image().scene(), "geometry-image") as tracer, tracer.gpu:
        tree = tracer.accelerator.structure
        lo, hi = (read_texture(tracer.session.tables[name][f"{name}_table"]).reshape(-1, 4)
                  [:len(tree.miss), :3] for name in ("min_pyramid", "max_pyramid"))
    return tree, lo, hi


def image() -> rt.GeometryImage:
    return rt.GeometryImage([surface().image])


def level(tree: ImageTree, boxes: np.ndarray, height: int) -> np.ndarray:
    """Return a level of a pyramid as an image, (side, side, 3)."""
    node = np.arange(tree.levels[height], tree.levels[height + 1])
    first = node
    for _ in range(height):
        first = tree.first[first]
    row, column = np.divmod(tree.first[first], tree.charts[0][1])
    side = -(-SIZE // 2**height)
    shown = np.zeros((side, side, 3))
    shown[row >> height, column >> height] = boxes[node]
    return shown


def rows() -> list[list[Any]]:
    tree, lo, hi = pyramids()
    whole = float((hi.max(axis=0) - lo.min(axis=0)).max())
    return [[height, int(end - begin), 4**height,
             float((hi[begin:end] - lo[begin:end]).max(axis=1).mean()) / whole]
            for height, (begin, end) in enumerate(pairwise(tree.levels.tolist()))]


def colours(positions: np.ndarray) -> np.ndarray:
    """Return x, y, z in the scene's box as red, green, blue."""
    lo, hi = (corner.astype(np.float64) for corner in image().scene().bounds)
    return np.clip((positions - lo) / (hi - lo), 0, 1)


def picture(scene: rt.Scene, method: str, **options: Any) -> np.ndarray:
    camera = rt.Camera((2.6, 2.2, 5.6), (0.0, 0.55, 0.2), fov=38)
    with rt.Tracer(scene, method, **options) as tracer:
        return np.asarray(tracer.render(camera, (256, 256)))


def draw(data: Path, out: Path, full: bool) -> None:
    write_csv(out / "fig21.csv", HEADS, rows())
    write_text(out / "fig21.md", (
        "# Figure 21: a geometry image, and the pyramids over it\n\n"
        f"A closed mesh of {len(horned().faces):,} triangles is cut open and spread over a "
        f"square. Its image of {SIZE + 1} x {SIZE + 1} positions is again a closed mesh, of "
        f"{2 * SIZE * SIZE:,} triangles. A node of the quadtree holds the minimum and the maximum "
        "of its cells' positions. Fragment passes make these two pyramids, one pass a level. The "
        "pictures of the pyramids show the textures with which rays are traced.\n\n"
        + markdown_table(HEADS, [[number(v) if isinstance(v, float) else v for v in row]
                                 for row in rows()])))
    figure, axes = plt.subplots(4, 4, figsize=(10.4, 12.0))
    for axis in axes.flat:
        axis.set_axis_off()
    made, scene = image(), image().scene(colours=(0.66, 0.55, 0.42))
    mesh, flat = surface().mesh, surface().flat
    axes[0, 0].imshow(picture(rt.Scene.from_trimesh(horned()), "bvh-threaded"))
    axes[0, 1].triplot(flat[:, 1], flat[:, 0], mesh.faces, lw=0.15, color="#2f6db3")
    loop = mesh.start[mesh.loops()[0]]
    axes[0, 1].scatter(flat[loop, 1], flat[loop, 0], c=colours(mesh.vertices[loop]), s=3, zorder=3)
    axes[0, 1].invert_yaxis()
    axes[0, 1].set_aspect("equal")
    axes[0, 2].imshow(colours(made.charts[0]))
    axes[0, 3].imshow(made.normals()[0] / 2 + 0.5)
    titles = ["the mesh", "spread over a square; its\nboundary (the cuts) coloured by position",
              "position image: x, y, z\nas red, green, blue", "normal image"]
    tree, lo, hi = pyramids()
    for column, height in enumerate(SHOWN):
        for row, boxes, name in ((1, lo, "minimum"), (2, hi, "maximum")):
            shown = level(tree, boxes, height)
            axes[row, column].imshow(colours(shown), interpolation="nearest")
            titles.append(f"{name}, {len(shown)} x {len(shown)} nodes")
    for stop, axis in enumerate(axes[3]):
        axis.imshow(picture(scene, "geometry-image", level=stop))
        titles.append(f"traced, level of detail {stop}")
    order = [*axes[0], *(axes[row, column] for column in range(4) for row in (1, 2)), *axes[3]]
    for axis, title in zip(order, titles):
        axis.set_title(title, fontsize=8)
    figure.tight_layout(rect=(0, 0.03, 1, 0.98), h_pad=2.0)
    save_chart(figure, out / "fig21.png", "The boxes are those that the passes wrote. Bottom row: "
               "rays through the same pyramids stop at quads of 2^level x 2^level cells.",
               "Four rows of pictures: a mesh, its triangles in a square, and its geometry image; "
               "the pyramid of minima over the image; the pyramid of maxima; and the mesh traced "
               "at four levels of detail")
