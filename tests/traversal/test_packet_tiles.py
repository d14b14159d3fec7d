"""Packet methods skip tiles without live rays: no hit changes, and skipped tiles do no work."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.gl.observation import Observer
from gpgpu_rt.rays import batch as ray_batch
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.tile_bounds import SIDE

METHODS = [row.name for row in rt.methods() if any(o.name == "packet" for o in row.options)]
PACKETS = [(1, 1), (2, 1), (2, 2), (4, 2), (4, 4)]
ENTRIES = [None, 8, 16, 32]


def seen(size: tuple[int, int], seed: int) -> tuple[rt.Scene, np.ndarray, np.ndarray]:
    """Returns a scene, and the origins and directions of an image's rays from one point. The
    scene's triangles lie within about a quarter of the image, near the image's middle."""
    rng = np.random.default_rng(seed)
    scene = soup_scene(200, seed, size=0.05)
    width, height = size
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    directions = np.float32(np.stack([x, y, np.full_like(x, 2.0)], axis=2))
    origin = scene.triangles.mean((0, 1)) - np.float32([*rng.normal(size=2) * 0.1, 2.5])
    return scene, np.broadcast_to(np.float32(origin), directions.shape), directions


def whole(tracer: rt.Tracer, *rays: np.ndarray, **ends: object) -> rt.Hits:
    """Returns the hits of a call that draws all packets."""
    with tracer.gpu.observed(Observer(), whole=True):
        return tracer.trace(*rays, **ends)


@pytest.mark.parametrize("t_min", [0.0, -2.0])
@pytest.mark.parametrize("size", [(8, 8), (13, 7), (70, 41)], ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("at_once", [1 << 17, 600])
@pytest.mark.parametrize("broken", [0.0, 0.1])
def test_bounds_of_tiles(monkeypatch: pytest.MonkeyPatch, broken: float, at_once: int,
                         size: tuple[int, int], t_min: float) -> None:
    """A tile's bounds are the bounds of its live rays' directions, even if a batch is processed in
    blocks of AT_ONCE rays. A batch has no tiles if a row of tiles is larger than a block."""
    monkeypatch.setattr(ray_batch, "AT_ONCE", at_once)
    rng = np.random.default_rng(3)
    width, height = size
    directions = rng.normal(size=(height, width, 3)).astype(np.float32)
    directions[rng.random((height, width)) < broken] = np.nan
    directions[0, 0] = -1
    t_max = np.where(rng.random((height, width)) < 0.8, -3.0, 1.0)
    t_max[:SIDE, :SIDE] = -3
    t_max[0, 0] = t_min  # the only t at which this ray may hit
    batch = RayBatch(np.zeros_like(directions), directions, t_min, t_max.ravel(), invalid="miss",
                     tiled=True)
    if SIDE * width > at_once:
        assert batch.tiles is None
        return
    assert batch.tiles is not None and (batch.start is not None) == (
        t_min == 0 and not broken)
    fields = batch.given_fields()
    live = (fields["t_min"] <= fields["t_max"]).reshape(height, width)
    assert live.any() and not live.all()
    along = fields["direction"].reshape(height, width, 3)
    for times in (1, 2, 4):
        tiles, side = batch.tiles.of_side(times * SIDE), times * SIDE
        assert tiles.size == (-(-width // side), -(-height // side))
        for y in range(tiles.size[1]):
            for x in range(tiles.size[0]):
                part = np.s_[y * side:(y + 1) * side, x * side:(x + 1) * side]
                assert tiles.live[y, x] == live[part].any()
                if tiles.live[y, x] and batch.start is not None:
                    mine = along[part][live[part]]
                    assert (tiles.least[y, x] == mine.min(0)).all()
                    assert (tiles.most[y, x] == mine.max(0)).all()


@pytest.mark.parametrize("packet", PACKETS, ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [(16, 16), (13, 7), (70, 75)], ids="{0[0]}x{0[1]}".format)
def test_no_hit_is_lost(precise_renderer, method: str, packet: tuple[int, int],
                        size: tuple[int, int]) -> None:
    scene, origins, directions = seen(size, 5)
    rng = np.random.default_rng(6)
    t_max = np.where(rng.random(origins.shape[:2]) < 0.1, -1.0, np.inf)
    t_max[:, :size[0] // 3] = -1.0  # in a large image, whole tiles have no live ray
    broken = directions.copy()
    broken[-1, -1] = np.nan  # the batch replaces this ray's origin, so origins differ
    with rt.Tracer(scene, method, packet=packet) as tracer:
        for along in (directions, broken):
            ends = {"t_max": t_max.ravel(), "invalid": "miss"}
            expected = whole(tracer, origins, along, **ends)
            assert 0 < expected.hit.sum() < len(expected)
            assert_same_bits(tracer.trace(origins, along, **ends), expected)
            nothing = tracer.trace(origins, along, t_max=-1.0, invalid="miss")
            assert not nothing.hit.any()
            assert (tracer.occluded(origins, along, **ends) == expected.hit).all()


@pytest.mark.parametrize("tile", ENTRIES)
@pytest.mark.parametrize("packet", PACKETS[:-1], ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("size", [(16, 16), (13, 7), (70, 75)], ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("part", [0.0, 0.5, 1.0], ids="live-{}".format)
def test_each_packet_is_drawn_once(part: float, size: tuple[int, int], packet: tuple[int, int],
                                   tile: int | None) -> None:
    """A square of packets is drawn as a point, and the points cover each packet once. If the
    occlusion query counted fewer packets than were drawn, all packets would be drawn again. If
    every tile has live rays, one draw covers the image."""
    scene, origins, directions = seen(size, 4)
    directions = directions * np.float32([0.02, 0.02, 1])  # aim at the middle of the triangles
    t_max = np.where(np.arange(size[0]) < part * size[0], np.inf, -1.0)
    t_max = np.broadcast_to(t_max, origins.shape[:2]).ravel()
    with rt.Tracer(scene, "bvh-packet", packet=packet, entry_points=tile) as tracer:
        tracer.trace(origins, directions, t_max=t_max)
        found = tracer.statistics
        assert (found.queries, found.passes) == (1, 1)
        beams = tile is not None
        assert found.draw_calls - beams <= (1 if part == 1 else 2)
        assert found.draw_calls - beams == 2 or part == 1 or size != (70, 75) or packet == (4, 4)


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("octants", [False, True], ids=["stack", "octants"])
@pytest.mark.parametrize("tile", ENTRIES[1:])
def test_no_aimed_ray_is_lost(precise_renderer, tile: int, octants: bool, seed: int) -> None:
    """No ray is lost, even if all rays of a tile aim at one vertex or one point of an edge. The
    beam around the rays is then as narrow as a ray, and bounding boxes end at this point."""
    scene = soup_scene(300, seed, size=0.05)
    rng = np.random.default_rng(seed)
    count = 24
    triangles = scene.triangles[rng.integers(len(scene), size=count * count)].astype(np.float64)
    along = rng.choice([0, 0, 0.25, 0.5], count * count)[:, None]
    target = triangles[:, 0] * (1 - along) + triangles[:, 1] * along
    for origin in ((0.1, 0.2, 0.3), (3, 0.5, -2), (0, 0, 40)):
        directions = np.float32(target - origin).reshape(count, count, 3)
        directions = directions.repeat(tile, axis=0).repeat(tile, axis=1)
        origins = np.broadcast_to(np.float32(origin), directions.shape)
        with rt.Tracer(scene, "brute-force") as tracer:
            expected = tracer.trace(origins[::tile, ::tile], directions[::tile, ::tile])
        with rt.Tracer(scene, "bvh-packet", packet=(4, 2), octants=octants, interval_test=True,
                       entry_points=tile) as tracer:
            hits = tracer.trace(origins, directions)
        assert 0.3 < expected.hit.mean() < 1
        found = hits.triangle.reshape(directions.shape[:2])
        assert (found == expected.triangle.reshape(count, count).repeat(
            tile, axis=0).repeat(tile, axis=1)).all()


@pytest.mark.parametrize("tile", ENTRIES)
def test_what_is_left_out_counts_nothing(precise_renderer, tile: int | None) -> None:
    """A call that skips tiles is compared with a call that draws all packets. If tiles are
    skipped, a ray's counters stay the same or become zero. At most half of the fragments then run
    `packet.frag`, and the other fragments run `packet_none.frag`."""
    scene, origins, directions = seen((128, 128), 7)
    t_max = np.full(origins.shape[:2], np.inf)
    t_max[:, 64:] = -1
    with rt.Tracer(scene, "bvh-packet", packet=(4, 2), entry_points=tile,
                   statistics=True) as tracer:
        expected = whole(tracer, origins, directions, t_max=t_max.ravel())
        calls, log = tracer.statistics.draw_calls, fragments(tracer)
        hits = tracer.trace(origins, directions, t_max=t_max.ravel())
        # A call that skips tiles needs one more draw call for hits, and one for counters.
        assert tracer.statistics.draw_calls == calls + 2
        left = fragments(tracer)
    assert_same_bits(hits, expected)
    assert log["drivers/packet_none.frag"] == 0
    assert left["drivers/packet.frag"] + \
        left["drivers/packet_none.frag"] == log["drivers/packet.frag"]
    assert left["drivers/packet.frag"] <= log["drivers/packet.frag"] / 2
    for name in ("nodes_visited", "triangles_tested", "steps"):
        mine, theirs = getattr(hits, name), getattr(expected, name)
        assert ((mine == theirs) | (mine == 0)).all() and (mine == theirs)[hits.hit].all()
        assert mine.reshape(128, 128)[:, 64:].sum() == 0 < mine.sum()


def fragments(tracer: rt.Tracer) -> dict[str, int]:
    """Returns the number of fragments per program, for a call with statistics."""
    found = {"drivers/packet_none.frag": 0}
    for entry in tracer.statistics.pass_log:
        found[entry["name"]] = found.get(entry["name"], 0) + entry["fragments"]
    return found
