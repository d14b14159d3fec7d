"""Tests of settings files, `Tracer.from_settings` and the method "auto"."""
from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.methods import settings
from gpgpu_rt.methods.choices import Choice, Choices
from gpgpu_rt.rays.ray_sets import random_rays


@pytest.fixture
def scene() -> rt.Scene:
    return soup_scene(200, seed=1)


@pytest.fixture
def found(scene: rt.Scene) -> settings.Settings:
    """Return settings with one choice, kd-restart, for all rays."""
    return settings.Settings(settings.describe(scene), open_gpu().renderer, Choices.one(Choice(
        "kd-restart", {"schedule": "loop", "intersection": "moller-trumbore"},
        {"max_wrong": 1e-3}, {"rays": 10})))


@pytest.fixture
def pair(found: settings.Settings) -> settings.Settings:
    """Return settings with two choices: packets for coherent rays, kd-restart for other rays."""
    packets = Choice("bvh-packet", {"packet": (4, 2), "octants": True}, {"max_wrong": 1e-4}, {})
    return replace(found, choices=Choices(packets, found.choices.incoherent))


def one_choice(entries: dict) -> dict:
    """Return the file's content in the earlier format, which held one choice."""
    return {"format": 1, "scene": entries["scene"], "renderer": entries["renderer"],
            **entries["incoherent"]}


def test_settings_trace_as_their_options_do(scene, found, tmp_path) -> None:
    path = tmp_path / "settings.json"
    found.save(path)
    assert settings.load(path) == found
    rays = scene.camera.rays((16, 16))
    with rt.Tracer.from_settings(scene, path) as tracer:
        assert tracer.method.name == "kd-restart" and tracer.settings == found
        assert tracer.options["intersection"] == "moller-trumbore"
        hits = tracer.trace(*rays)
    with rt.Tracer(scene, "kd-restart", intersection="moller-trumbore") as tracer:
        assert tracer.settings is None
        assert_same_bits(hits, tracer.trace(*rays))


def test_two_choices_are_read_back(scene, pair, tmp_path) -> None:
    """A tracer made from a file with two choices picks the method according to the rays."""
    path = tmp_path / "settings.json"
    pair.save(path)
    assert settings.load(path) == pair and pair.choices.differ
    with rt.Tracer.from_settings(scene, path) as tracer, rt.Tracer(scene, "kd-restart",
                                                                   precision="fp32") as other:
        assert tracer.method.name == "bvh-packet" and tracer.options["packet"] == (4, 2)
        assert_same_bits(other.trace(*scene.camera.rays((8, 8))),
                         tracer.trace(*scene.camera.rays((8, 8))))
        tracer.trace(*random_rays(scene, 64, 1))
        assert tracer.method.name == "kd-restart" and tracer.statistics.choice == "incoherent"
        assert tracer.options["intersection"] == "moller-trumbore"


def test_a_file_in_the_earlier_format_is_read(scene, found, tmp_path) -> None:
    """A file in the earlier format, with one choice, serves coherent and incoherent rays."""
    path = tmp_path / "settings.json"
    found.save(path)
    path.write_text(json.dumps(one_choice(json.loads(path.read_text()))))
    assert settings.load(path) == found and not found.choices.differ
    with rt.Tracer.from_settings(scene, path) as tracer:
        for rays in (scene.camera.rays((8, 8)), random_rays(scene, 64, 1)):
            tracer.trace(*rays)
            assert tracer.method.name == "kd-restart" and tracer.statistics.choice == ""


DROP = object()


@pytest.mark.parametrize("change, message", [
    ({"format": 3}, "format is 3"), ({"format": True}, "format"), ({"format": DROP}, "format"),
    ({"scene": DROP}, "scene is missing"), ({"scene": []}, "scene is"),
    ({"scene": {"name": "x", "triangles": 1}}, "scene.sha256 is missing"),
    ({"scene": {"name": "x", "triangles": "1", "sha256": ""}}, "scene.triangles"),
    ({"renderer": 3}, "renderer"), ({"coherent": DROP}, "coherent is missing"),
    ({"incoherent": []}, "incoherent is"), ({"method": "grid"}, "unknown key method"),
    ({"sceen": {}}, "unknown key sceen; did you mean scene"),
])
def test_a_bad_key_is_named(found, tmp_path, change: dict, message: str) -> None:
    path = tmp_path / "settings.json"
    found.save(path)
    check_refusal(path, {**json.loads(path.read_text()), **change}, message)


@pytest.mark.parametrize("change, message", [
    ({"method": "kd-restrat"}, "method: .*did you mean kd-restart"),
    ({"options": {"octants": True}}, "options: .*octants"),
    ({"options": {"schedule": "lop"}}, "options: .*schedule"),
    ({"options": {"statistics": True}}, "options.statistics"),
    ({"promise": None}, "promise"), ({"measured": 1}, "measured"),
    ({"metod": "grid"}, "metod; did you mean method"),
])
def test_a_bad_key_of_a_choice_is_named(found, tmp_path, change: dict, message: str) -> None:
    path = tmp_path / "settings.json"
    found.save(path)
    entries = json.loads(path.read_text())
    for rays in ("coherent", "incoherent"):
        check_refusal(path, {**entries, rays: {**entries[rays], **change}}, f"{rays}.{message}")
    check_refusal(path, {**one_choice(entries), **change}, message)


def check_refusal(path, entries: dict, message: str) -> None:
    path.write_text(json.dumps({k: v for k, v in entries.items() if v is not DROP}))
    with pytest.raises(rt.SettingsError, match=message) as caught:
        settings.load(path)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"[1]", b"{", b"\xff\xfe\x00"])
def test_other_files_are_refused(tmp_path, content: bytes) -> None:
    """A missing file is refused, and so is a file whose content is not a JSON object."""
    path = tmp_path / "settings.json"
    path.write_bytes(content)
    with pytest.raises(rt.SettingsError, match="settings.json"):
        settings.load(path)
    with pytest.raises(rt.SettingsError, match="No such file"):
        settings.load(tmp_path / "gone.json")


def test_another_scene_or_renderer_is_refused(scene, found, tmp_path) -> None:
    path = tmp_path / "settings.json"
    found.save(path)
    other = soup_scene(201, seed=1)
    with pytest.raises(rt.SettingsError, match="200 triangles, but this scene is soup with 201"):
        rt.Tracer.from_settings(other, path)
    moved = soup_scene(200, seed=2)
    with pytest.raises(rt.SettingsError, match="has other triangles"):
        rt.Tracer.from_settings(moved, path)
    with rt.Tracer.from_settings(moved, path, force=True) as tracer:
        assert tracer.method.name == "kd-restart"
    replace(found, renderer="GeForce 6800").save(path)
    with pytest.raises(rt.SettingsError, match="'GeForce 6800', but this renderer is"):
        rt.Tracer.from_settings(scene, path)


def test_options_beside_settings(scene, found, tmp_path) -> None:
    """With a settings file, an option of the method may only repeat the file's value."""
    path = tmp_path / "settings.json"
    found.save(path)
    with rt.Tracer.from_settings(scene, path, statistics=True, schedule="loop") as tracer:
        assert tracer.options["statistics"]
    for name, value in (("schedule", "step"), ("storage", "fp16")):
        with pytest.raises(rt.OptionError, match=f"option {name}={value}"):
            rt.Tracer.from_settings(scene, path, **{name: value})


def test_auto(scene, found, tmp_path, monkeypatch) -> None:
    """`auto` uses the settings stored for the scene. Without usable settings, it uses a safe
    default."""
    def chosen(**options) -> tuple[str, settings.Settings | None]:
        with rt.Tracer(scene, "auto", **options) as tracer:
            return tracer.method.name, tracer.settings

    safe = ("bvh-packet", None)
    monkeypatch.setenv("GPGPU_RT_CACHE", "")
    assert settings.store(found) is None and chosen() == safe
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path / "cache"))
    assert chosen() == safe
    path = settings.store(found)
    assert chosen() == ("kd-restart", found) == chosen(statistics=True)
    with pytest.warns(UserWarning, match="octants=False: the settings file fixed all options"):
        assert chosen(octants=False) == safe
    with pytest.warns(UserWarning, match="entry_points=4: the settings file fixed all options"):
        assert chosen(entry_points=4) == ("bvh-threaded", None)
    settings.store(replace(found, renderer="GeForce 6800"))
    assert chosen() == ("kd-restart", found)
    path.write_text(path.read_text()[:-20])
    with pytest.warns(UserWarning, match=f"safe default .*: {path}: not JSON"):
        assert chosen() == safe

    def closed(path: Path) -> bool:
        raise PermissionError(13, "Permission denied", str(path))
    with monkeypatch.context() as closing:      # a folder without permission to search
        closing.setattr(Path, "is_file", closed)
        with pytest.warns(UserWarning, match="safe default .*Permission denied"):
            assert chosen() == safe
    path.unlink()
    with rt.Tracer(scene, "auto") as tracer:
        assert tracer.options["octants"]


def test_commands_use_settings(capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", "")
    scene = rt.load_scene("cornell")
    path, image = tmp_path / "settings.json", tmp_path / "box.png"
    grid = Choices.one(Choice("grid", {"schedule": "step"}))
    settings.Settings(settings.describe(scene), open_gpu().renderer, grid).save(path)
    render = ["render", "cornell", "--size", "8", "-o", str(image)]
    assert cli.main([*render, "--settings", str(path), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["method"] == "grid" and report["options"]["schedule"] == "step"
    assert cli.main([*render, "-m", "auto"]) == 0
    out = capsys.readouterr().out
    assert "bvh-packet on" in out and "auto used a safe default for coherent rays" in out
    origins, directions = scene.camera.rays((4, 4))
    np.savez(tmp_path / "rays.npz", origins=origins, directions=directions)
    trace = [str(tmp_path / "rays.npz"), "-o", str(tmp_path / "hits.npz"), "--settings", str(path)]
    assert cli.main(["trace", "cornell", *trace]) == 0
    assert "grid" in capsys.readouterr().out
    origins, directions = random_rays(scene, 64, 1)
    np.savez(tmp_path / "random.npz", origins=origins, directions=directions)
    trace = ["trace", "cornell", str(tmp_path / "random.npz"), "-o", str(tmp_path / "hits.npz")]
    assert cli.main([*trace, "-m", "auto", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["method"] == report["statistics"]["method"] == "bvh-threaded"
    assert report["statistics"]["choice"] == "incoherent"
    packets = Choices(Choice("bvh-packet"), grid.incoherent)
    settings.Settings(settings.describe(scene), open_gpu().renderer, packets).save(path)
    assert cli.main([*trace, "--settings", str(path)]) == 0
    out = capsys.readouterr().out
    assert "grid on" in out and f"{path} chose this method for incoherent rays" in out
    image.unlink()
    for more, message in ((["--settings", str(path), "-m", "grid"], "not both"),
                          (["--force"], "--settings"),
                          (["--settings", str(path), "--schedule", "loop"], "schedule=loop"),
                          (["--settings", str(tmp_path / "gone")], "cannot read settings")):
        assert cli.main([*render, *more]) == 1
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1 and not image.exists()
    assert cli.main(["render", "shirley6", "-o", str(image), "--settings", str(path)]) == 1
    assert "shirley6" in capsys.readouterr().err
