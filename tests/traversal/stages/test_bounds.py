"""Rasterised bounds: an eye ray searches only between the nearest and the farthest depth that the
rasteriser drew in the ray's tile. The hits stay the same to the bit."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.scene.camera import Camera

METHODS = ("brute-force", "bvh-threaded", "kd-restart", "kd-packet")
TILES = (4, 8, 16)


def of(triangles: np.ndarray) -> rt.Scene:
    return rt.Scene.from_arrays(triangles.reshape(-1, 3),
                                np.arange(3 * len(triangles)).reshape(-1, 3))


def aimed_scene(camera: Camera, size: tuple[int, int], count: int, kind: str,
                seed: int) -> rt.Scene:
    """Return triangles with corners on rays through pixels. The triangles' outlines go through
    pixel centres, and often along the edges of tiles.

    The corners are a few pixels apart for `near`, and many pixels apart for `far`. For
    `tiny` and `slivers`, all corners are near one ray. For `behind`, some or all corners may be
    behind the eye. For `beside`, the corners are close to the eye, in front or behind. For
    `edge-on`, the eye lies in the triangle's plane.
    """
    rng = np.random.default_rng(seed)
    origins, directions = (values.reshape(-1, 3).astype(np.float64)
                           for values in camera.rays(size))
    width, height = size
    reach = {"near": 6, "tiny": 0, "slivers": 0, "edge-on": 20}.get(kind, max(size))
    first = np.stack([rng.integers(width, size=count), rng.integers(height, size=count)], 1)
    offset = rng.integers(-reach, reach + 1, (count, 3, 2))
    if kind == "edge-on":
        offset[:, 2] = 2 * offset[:, 1] - offset[:, 0]
    pixel = np.clip(first[:, None] + offset, 0, [width - 1, height - 1])
    ray = pixel[..., 0] + width * pixel[..., 1]
    depth = 10 ** rng.uniform(-1, 1.5, (count, 1)) * 10 ** rng.uniform(-0.3, 0.3, (count, 3))
    if kind == "behind":
        depth *= np.where(rng.random((count, 3)) < 0.5, -1, 1)
    elif kind == "beside":
        depth *= 10 ** rng.uniform(-6, -2, (count, 3)) * rng.choice([-1, 1], (count, 3))
    corners = origins[ray] + depth[..., None] * directions[ray]
    if kind in ("tiny", "slivers"):
        small = 10 ** rng.uniform(-7, -2, (count, 1, 1)) * depth[..., None]
        corners += small * rng.normal(size=corners.shape)
        corners[::3, 0] -= small[::3, 0] * rng.normal(size=(len(corners[::3]), 3))
    return of(corners.astype(np.float32))


CAMERA = Camera((0.3, -0.2, 2.0), (0.1, 0.3, -5.0), fov=70)


def check(scene: rt.Scene, camera: Camera | None, size: tuple[int, int], method: str,
          tile: int) -> tuple[rt.Hits, rt.Hits]:
    camera = camera or scene.camera
    with rt.Tracer(scene, method, statistics=True) as tracer:
        plain = tracer.eye_hits(camera, size)
    with rt.Tracer(scene, method, statistics=True, rasterised_bounds=tile) as tracer:
        for _ in range(2):
            hits = tracer.eye_hits(camera, size)
            assert_same_bits(hits, plain)
            assert not hits.status.any()
    return hits, plain


KINDS = ("near", "far", "tiny", "slivers", "behind", "beside", "edge-on")


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("kind", KINDS)
def test_aimed_eye_rays_lose_no_hit(precise_renderer, kind: str, seed: int) -> None:
    """No hit is lost. The image has 50 x 37 pixels, which are not multiples of a tile's side."""
    count = 40 if kind in ("far", "behind") else 400
    scene = aimed_scene(CAMERA, (50, 37), count, kind, seed)
    for method, tile in zip(METHODS, (*TILES, 8)):
        hits, plain = check(scene, CAMERA, (50, 37), method, tile)
        assert hits.nodes_visited.mean() <= plain.nodes_visited.mean() or method == "kd-packet"
    assert 0.005 < hits.hit.mean()


@pytest.mark.full
@pytest.mark.parametrize("seed, tile", [(11, 8), (12, 4)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_million_aimed_eye_rays(precise_renderer, kind: str, seed: int, tile: int) -> None:
    """Each of the seven kinds of triangles is tested with 154,179 rays."""
    count, size = 100 if kind in ("far", "behind", "beside") else 6_000, (463, 333)
    check(aimed_scene(CAMERA, size, count, kind, seed), CAMERA, size, "bvh-threaded", tile)


def test_empty_tiles_are_misses_and_walls_end_rays(precise_renderer) -> None:
    """A wall hides the soup in the left half of the image, so rays there end at the wall. The
    right half shows the soup, and rays in its empty tiles visit no node."""
    soup = soup_scene(500, 3, size=0.02).triangles + np.float32([0, 0, -4])
    wall = np.float32([[[-90, -90, -1], [0.3, -90, -1], [0.3, 90, -1]],
                       [[-90, -90, -1], [0.3, 90, -1], [-90, 90, -1]]])
    camera = Camera((0.3, 0.4, 0.0), (0.3, 0.4, -1.0), fov=60)
    scene = of(np.concatenate([soup, wall]).astype(np.float32))
    hits, plain = check(scene, camera, (64, 64), "kd-restart", 4)
    left = np.arange(64 * 64) % 64 < 30
    assert (hits.triangle[left] >= 500).all()
    empty = ~hits.hit & (hits.nodes_visited == 0)
    assert empty.mean() > 0.1 and not (plain.nodes_visited[empty] == 0).all()
    assert hits.nodes_visited.mean() < 0.8 * plain.nodes_visited.mean()


@pytest.mark.parametrize("tile", TILES, ids="tile{}".format)
def test_pictures_are_the_same(precise_renderer, tile: int) -> None:
    scene = rt.load_scene("cornell")
    moved = scene.triangles[:, ::-1] * np.float32(0.5)     # half as large
    far = Camera(tuple(np.asarray(scene.camera.eye) * 50), scene.camera.target)
    pictures = []
    for options in ({}, {"rasterised_bounds": tile}, {"rasterised_bounds": tile,
                                                      "entry_points": 16, "sort_rays": True}):
        with rt.Tracer(scene, "bvh-threaded", **options) as tracer:
            mine = [tracer.render(size=(61, 47)), tracer.render(far, (61, 47))]
            tracer.update(moved)
            mine += [tracer.render(size=(61, 47))]
        pictures.append([np.asarray(picture) for picture in mine])
    for other in pictures[1:]:
        for one, two in zip(pictures[0], other):
            assert (one == two).all()


def test_nothing_to_draw() -> None:
    nothing = rt.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    with rt.Tracer(nothing, "bvh-threaded", rasterised_bounds=8) as tracer:
        assert not tracer.eye_hits(CAMERA, (9, 5)).hit.any()


@pytest.mark.parametrize("options", [{"intersection": "moller-trumbore"}, {"precision": "fp16"}])
def test_refused_where_the_bounds_are_not_proved(options: dict) -> None:
    """The option `rasterised_bounds` is refused with triangle tests and precisions for which no
    proof shows that the bounds contain all hits."""
    with pytest.raises(rt.OptionError, match="woop-watertight"):
        rt.Tracer("cornell", rasterised_bounds=8, **options)
