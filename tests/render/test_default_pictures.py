"""The package adds a missing camera or light to a scene. The camera sees the whole object, or is
inside the room. Further tests check `--floor`."""
from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.scene import catalogue
from gpgpu_rt.scene.framing import MARGIN, beside, framed, inside
from gpgpu_rt.scene.procedural import walker
from gpgpu_rt.scene.procedural.shapes import ball, boxes

OBJECTS = ("bunny", "buddha", "teapot", "cow", "boulder", "knot", "explosion", "cloth")


def places(camera: rt.Camera, triangles: np.ndarray, size: tuple[int, int] = (1, 1)) -> np.ndarray:
    """Return (n, 2) positions of the corners in the picture, whose edges are at -1 and 1."""
    right, up, forward = camera.basis(size)
    away = triangles.reshape(-1, 3) - np.array(camera.eye)
    return np.stack([away @ right / (right @ right), away @ up / (up @ up)], 1) / (
        away @ forward)[:, None]


@pytest.mark.parametrize("name", OBJECTS)
def test_built_in_objects_are_whole_in_the_picture(name: str) -> None:
    """At least 2 % of the picture is free on each side. These cameras may ignore the larger
    MARGIN, because figures were measured with them."""
    built = catalogue.ROWS[name].make()
    assert np.abs(places(built.camera, built.triangles)).max() < 0.96


@pytest.mark.parametrize("frame", range(0, 97, 12))
def test_moving_objects_are_whole_in_the_picture(frame: int) -> None:
    cloth, animal = rt.load_animation("cloth"), len(walker._rest()[0])
    corners = cloth.scene.moved(cloth.vertices(frame)).triangles
    assert np.abs(places(cloth.scene.camera, corners)).max() < 0.95
    corners = walker.walker_at(frame / 24)[:animal]
    assert np.abs(places(walker.walker().camera, corners)).max() < 0.95


@pytest.mark.parametrize("scale, far", [(1, 0), (1e-20, 0), (1e20, 0), (1, 1e3)])
@pytest.mark.parametrize("size", [(1, 1), (300, 100), (100, 300)])
@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_framed_objects_touch_their_margin(seed: int, size: tuple[int, int], scale: float,
                                           far: float) -> None:
    """A framed object fills the picture up to the margin, at any scale and place."""
    rng = np.random.default_rng(seed)
    triangles = scale * (rng.normal(size=(40, 3, 3)) * rng.uniform(0.1, 3, 3) + far)
    found = places(framed(triangles, size), triangles, size)
    assert np.abs(found).max() == pytest.approx(1 - 2 * MARGIN, rel=1e-6)
    # Along the axis that limits the frame, both margins are equal.
    low, high = found.min(axis=0), found.max(axis=0)
    assert np.abs(low + high).min() < 1e-6


def test_a_mesh_file_of_an_object_fills_its_picture(tmp_path) -> None:
    built = catalogue.ROWS["cow"].make()
    scene = rt.load_scene(_saved(built.triangles, tmp_path / "cow.ply"))
    found = np.abs(places(scene.camera, scene.triangles)).max()
    assert 0.75 < found < 0.9


@pytest.mark.parametrize("integrator, options", [("whitted", {}), ("path", {"samples": 4})])
def test_a_room_from_a_file_is_lit_like_the_built_in_room(tmp_path, integrator: str,
                                                          options: dict) -> None:
    """The light must lie below the ceiling. The usual place beside the camera is above the
    ceiling."""
    built = catalogue.ROWS["kitchen"].make()
    named = rt.Scene("kitchen", built.triangles, built.colours, rt.PointLight(built.light),
                     built.camera)
    path = _saved(built.triangles, tmp_path / "room.ply")
    (tmp_path / "cameras.json").write_text(json.dumps({"room": built.camera.to_dict()}))
    greys = []
    for scene in (named, rt.load_scene(path)):
        with rt.Tracer(scene, "bvh-threaded") as tracer:
            greys.append(np.asarray(tracer.render(size=(40, 40), integrator=integrator,
                                                  **options).convert("L"), float))
    assert 0.75 < greys[1].mean() / greys[0].mean() < 1.33
    assert greys[1].std() > 0.5 * greys[0].std()


def _room() -> np.ndarray:
    """Return walls that face inwards around furniture, as in scanned and exported rooms."""
    walls = boxes((0, 0, 0), (8, 3, 6))[:, ::-1]
    things = [ball(200, (x, 0.5, z), (0.5, 0.5, 0.5)) for x in (2, 4, 6) for z in (2, 4)]
    return np.float32(np.concatenate([walls, *things]))


def test_a_room_in_a_file_is_seen_from_inside(tmp_path) -> None:
    path = _saved(_room(), tmp_path / "room.ply")
    with pytest.warns(UserWarning, match="room, so the camera is inside"):
        scene = rt.load_scene(path)
    for place in (scene.camera.eye, scene.light.position):
        assert (np.array(place) > (0, 0, 0)).all() and (np.array(place) < (8, 3, 6)).all()
    with rt.Tracer(scene) as tracer:
        seen = tracer.eye_hits(size=(24, 24))
    assert seen.hit.all() and (seen.triangle >= 12).any()


@pytest.mark.parametrize("name", OBJECTS + ("cornell", "stadium"))
@pytest.mark.parametrize("inwards", [False, True])
def test_objects_are_seen_from_outside(name: str, inwards: bool) -> None:
    """The camera is outside even if the triangles face inwards, and the light keeps its usual
    place beside the camera."""
    triangles = np.float32(catalogue.ROWS[name].make().triangles)[:, ::-1 if inwards else 1]
    camera = framed(triangles)
    assert inside(triangles, camera) is None
    assert beside(camera, triangles) == beside(camera)


@pytest.mark.parametrize("name, bounces", [("glass-teapot", 2), ("glass-teapot", 4),
                                           ("statue", 1)])
def test_where_paths_end_the_surroundings_show(name: str, bounces: int) -> None:
    """Rays that end at the limit of bounces show the surroundings, so hardly any pixel is
    black."""
    built = catalogue.ROWS[name].make()
    scene = rt.Scene(name, built.triangles, built.colours, camera=built.camera,
                     **built.appearance)
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        with pytest.warns(UserWarning, match=f"rays end after {bounces} bounces"):
            image = tracer.render(size=(48, 48), bounces=bounces, light_samples=1)
    assert (np.asarray(image.convert("L")) < 16).mean() < 0.001


def test_no_warning_where_no_path_is_cut_short(recwarn) -> None:
    """No warning about bounces appears if no path reaches the limit of bounces."""
    with rt.Tracer("cornell") as tracer:
        tracer.render(size=(8, 8))
    assert not [w for w in recwarn if "bounces" in str(w.message)]


def test_a_floor_is_there_when_asked_for(capsys, tmp_path) -> None:
    path = _saved(ball(80), tmp_path / "ball.ply")

    def render(*words: str) -> tuple[dict, np.ndarray]:
        target = tmp_path / "ball.png"
        assert cli.main(["render", str(path), "--size", "32", "--json", *words, "-o",
                         str(target)]) == 0
        from PIL import Image
        return json.loads(capsys.readouterr().out), np.asarray(Image.open(target).convert("L"),
                                                               float)
    (plain, without), (more, with_floor) = render(), render("--floor")
    assert more["triangles"] == plain["triangles"] + 2
    with rt.Tracer(rt.load_scene(path)) as tracer:
        assert np.array_equal(without, np.asarray(tracer.render(size=(32, 32)).convert("L")))
    # The bottom rows show only floor, and a part of the floor beside the ball lies in shadow.
    assert np.abs(with_floor - without)[-2:].min() > 1
    floor = with_floor[16:][without[16:] > 238]
    assert floor.min() < 0.75 * floor.max()


@pytest.mark.parametrize("words, message", [
    (["cloth", "--frames", "2", "-o", "{}/a.gif"], "--frames"),
    (["cornell", "-m", "auto", "-o", "{}/a.png"], "auto"),
    (["boulder", "-m", "geometry-image", "-o", "{}/a.png"], "geometry-image")])
def test_floors_that_are_refused(capsys, tmp_path, words: list[str], message: str) -> None:
    """`--floor` is refused for animations, for `auto` and for geometry images."""
    assert cli.main(["render", "--floor", *(w.replace("{}", str(tmp_path)) for w in words)]) == 1
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1 and not list(tmp_path.iterdir())


def _saved(triangles: np.ndarray, path) -> str:
    import trimesh
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    trimesh.Trimesh(triangles.reshape(-1, 3), faces, process=False).export(path)
    return str(path)


def test_a_floor_has_its_own_material_and_no_normals() -> None:
    """The floor lies below the scene."""
    from gpgpu_rt.cli.floor import on_floor
    scene = rt.load_scene("soft-shadows")
    more = on_floor(replace(scene, uv=np.zeros((len(scene), 3, 2), np.float32)))
    assert len(more) == len(scene) + 2 and more.materials[-1].name == "floor"
    assert (more.material_of[-2:] == len(scene.materials)).all() and not more.normals[-2:].any()
    assert more.triangles[-2:, :, 1].max() < scene.bounds[0][1]
