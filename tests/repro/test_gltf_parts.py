"""In the past, a scene file could not name some nodes of a glTF file. trimesh splits a node with
several materials into pieces with random names, and numbers nodes of equal names."""
from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt


def gltf(primitives: list[int], nodes: list[dict[str, object]]) -> str:
    """Return a glTF file of triangles. Mesh k has ``primitives[k]`` triangles, each with its own
    material."""
    count = sum(primitives)
    corners = np.float32([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    data = np.concatenate([corners + (0, 0, k) for k in range(count)], dtype=np.float32).tobytes()
    triangles = iter(range(count))
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [*range(len(nodes))]}],
        "nodes": nodes, "materials": [{"name": f"paint {k}"} for k in range(count)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": k}, "material": k}
                                   for _, k in zip(range(n), triangles)]} for n in primitives],
        "accessors": [{"bufferView": k, "componentType": 5126, "count": 3, "type": "VEC3"}
                      for k in range(count)],
        "bufferViews": [{"buffer": 0, "byteOffset": 36 * k, "byteLength": 36}
                        for k in range(count)],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64,"
                     + base64.b64encode(data).decode()}]})


@pytest.mark.parametrize("primitives, nodes", [
    ([2, 1], [{"name": "house", "mesh": 0}, {"name": "tree", "mesh": 1}]),
    ([1, 1, 1], [{"name": "house", "mesh": 0}, {"name": "house", "mesh": 1},
                 {"name": "tree", "mesh": 2}])], ids=["two materials", "two nodes"])
def test_a_part_is_named_by_its_node(tmp_path: Path, primitives: list[int],
                                     nodes: list[dict[str, object]]) -> None:
    """The first two triangles belong to the house."""
    (tmp_path / "village.gltf").write_text(gltf(primitives, nodes))
    (tmp_path / "scene.json").write_text(json.dumps({
        "meshes": [{"file": "village.gltf", "materials": {"house": "red"}}],
        "materials": {"red": {"diffuse": [1, 0, 0]}}, "environment": {"colour": [1, 1, 1]}}))
    scene = rt.load_scene(tmp_path / "scene.json")
    red = (np.asarray(scene.colours) == (1, 0, 0)).all(axis=1)
    depth = scene.triangles[:, 0, 2]
    assert (depth[red] < 2).all() and red.sum() == 2, f"red at z {depth[red]} of {depth}"


def test_a_wrong_name_is_answered_with_the_nodes_name(tmp_path: Path) -> None:
    (tmp_path / "village.gltf").write_text(gltf([2], [{"name": "house", "mesh": 0}]))
    (tmp_path / "scene.json").write_text(json.dumps({
        "meshes": [{"file": "village.gltf", "materials": {"hose": "red"}}],
        "materials": {"red": {"diffuse": [1, 0, 0]}}}))
    with pytest.raises(rt.SceneError, match="has no 'hose'; did you mean house"):
        rt.load_scene(tmp_path / "scene.json")


def test_a_child_whose_name_looks_like_a_random_ending(tmp_path: Path) -> None:
    """"facade" looks like a random ending of six hexadecimal digits, but is part of a name."""
    nodes = [{"name": "house", "mesh": 0, "children": [1]}, {"name": "house_facade", "mesh": 1}]
    text = gltf([1, 1], nodes).replace('"nodes": [0, 1]}]', '"nodes": [0]}]')
    (tmp_path / "village.gltf").write_text(text)
    (tmp_path / "scene.json").write_text(json.dumps({
        "meshes": [{"file": "village.gltf", "materials": {"house_facade": "red"}}],
        "materials": {"red": {"diffuse": [1, 0, 0]}}, "environment": {"colour": [1, 1, 1]}}))
    scene = rt.load_scene(tmp_path / "scene.json")
    red = (np.asarray(scene.colours) == (1, 0, 0)).all(axis=1)
    assert red.sum() == 1 and scene.triangles[red][0, 0, 2] == 1
