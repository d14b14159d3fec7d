"""``ro-crate-metadata.json`` describes the folder of drawn pages, and `crate.faults` finds
differences between the folder and the description."""
from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gpgpu_rt.errors import Error
from gpgpu_rt.figures import command
from gpgpu_rt.figures.framework import crate
from gpgpu_rt.gl.context import open_gpu


@pytest.fixture
def out(exact_renderer, tmp_path: Path) -> Path:
    (tmp_path / "charts").mkdir()
    (tmp_path / "charts" / "a b.png").write_bytes(b"\x89PNG")
    (tmp_path / "fig99.csv").write_text("a,b\n1,2\n")
    (tmp_path / "fig99.md").write_text("# Figure 99\n")
    (tmp_path / ".writing-half.md").write_text("not yet whole")
    (tmp_path / "fig99.json").write_text(json.dumps({
        "verdict": None, "cells": [], "drawn": {"renderer": "r", "commit": "c0ffee",
                                                "date": "2026-11-26"}}))
    crate.write(tmp_path)
    return tmp_path


def described(out: Path) -> dict[str, dict[str, Any]]:
    return {entity["@id"]: entity
            for entity in json.loads((out / crate.NAME).read_text())["@graph"]}


def test_the_description_is_an_ro_crate(out: Path) -> None:
    held = json.loads((out / crate.NAME).read_text())
    assert held["@context"][0] == "https://w3id.org/ro/crate/1.1/context"
    entities = described(out)
    assert len(entities) == len(held["@graph"])
    assert entities["ro-crate-metadata.json"]["conformsTo"] == {
        "@id": "https://w3id.org/ro/crate/1.1"}
    assert entities["./"]["@type"] == "Dataset" and entities["./"]["datePublished"]
    links = [value["@id"] for entity in held["@graph"] for key, found in entity.items()
             if key != "conformsTo" for value in (found if isinstance(found, list) else [found])
             if isinstance(value, dict)]
    assert set(links) <= set(entities)      # each link leads to an entity


def test_every_file_is_listed_with_its_size_and_digest(out: Path) -> None:
    entities = described(out)
    parts = {part["@id"] for part in entities["./"]["hasPart"]}
    assert parts == {"charts/a%20b.png", "fig99.csv", "fig99.json", "fig99.md"}
    table = entities["fig99.csv"]
    assert table["sha256"] == hashlib.sha256(b"a,b\n1,2\n").hexdigest()
    assert (table["@type"], table["contentSize"]) == ("File", "8")
    assert table["encodingFormat"] == "text/csv"
    assert "commit c0ffee" in entities["fig99.md"]["description"]
    assert crate.faults(out) == []


def test_the_run_names_its_environment(out: Path) -> None:
    entities = described(out)
    tools = {tool["@id"] for tool in entities["#run"]["instrument"]}
    assert tools == {"#gpgpu_rt", "#python", "#renderer", "#processor", "#system"}
    assert entities["#gpgpu_rt"]["softwareVersion"] == importlib.metadata.version("gpgpu_rt")
    assert entities["#python"]["softwareVersion"] == platform.python_version()
    assert entities["#renderer"]["name"] == open_gpu().renderer
    assert "Mesa" in entities["#renderer"]["softwareVersion"]
    assert all(entities[name]["value"] for name in ("#processor", "#commit"))


def _without(name: str, key: str) -> Callable[[Path], None]:
    def change(out: Path) -> None:
        held = json.loads((out / crate.NAME).read_text())
        next(entity for entity in held["@graph"] if entity["@id"] == name).pop(key)
        (out / crate.NAME).write_text(json.dumps(held))
    return change


def _outside(out: Path) -> None:
    text = (out / crate.NAME).read_text()
    (out / crate.NAME).write_text(text.replace('"fig99.csv"', '"../fig99.csv"'))


@pytest.mark.parametrize("damage, said", [
    (lambda out: (out / "fig99.csv").write_text("a,b\n1,3\n"), "fig99.csv: sha256 is "),
    (lambda out: (out / "fig99.md").write_text("#"), "fig99.md: contentSize is 12, but the file "),
    (lambda out: (out / "fig99.md").unlink(), "fig99.md: the file is missing"),
    (lambda out: (out / "new.md").write_text(""), "new.md: the file is not listed"),
    (_without("./", "license"), f"{crate.NAME}: ./ has no license"),
    (_without("#renderer", "softwareVersion"), f"{crate.NAME}: #renderer has no softwareVersion"),
    (_without("fig99.csv", "sha256"), "fig99.csv: sha256 is None, but the file has "),
    (_without("charts/a%20b.png", "@type"), "charts/a b.png: its @type is not File"),
    (_outside, "../fig99.csv: the file is outside of the folder")])
def test_a_difference_is_found(out: Path, capsys, damage: Callable[[Path], None],
                               said: str) -> None:
    damage(out)
    assert any(line.startswith(said) for line in crate.faults(out))
    assert command.main(["--check", "--out", str(out)]) == 1
    printed = capsys.readouterr().out
    assert said in printed and "fault" in printed.splitlines()[-1]


def test_a_sound_folder_passes(out: Path, capsys) -> None:
    assert command.main(["--check", "--out", str(out)]) == 0
    assert "4 files listed in ro-crate-metadata.json, all as listed" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["", "[]", '{"@graph": 3}', '{"@graph": [{"@id": "./"}]}'])
def test_a_malformed_description_is_refused_in_one_line(out: Path, capsys, text: str) -> None:
    (out / crate.NAME).write_text(text)
    with pytest.raises(Error, match="to write it again"):
        crate.faults(out)
    assert command.main(["--check", "--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("figures: ") and said.count("\n") == 1


def test_no_folder_is_made_by_a_check(tmp_path: Path, capsys) -> None:
    assert command.main(["--check", "--out", str(tmp_path / "none")]) == 1
    assert "No such file" in capsys.readouterr().err and not (tmp_path / "none").exists()


def test_a_failed_write_leaves_the_old_description(out: Path, monkeypatch) -> None:
    before = (out / crate.NAME).read_text()
    (out / "more.md").write_text("more")
    monkeypatch.setattr(crate, "environment", lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        crate.write(out)
    assert (out / crate.NAME).read_text() == before


def test_a_run_of_figures_ends_with_the_description(exact_renderer, tmp_path, monkeypatch,
                                                    capsys) -> None:
    """A run also prints a line for each folder that it makes."""
    monkeypatch.setattr(command, "measure", lambda *given: None)
    monkeypatch.setattr(command.pages, "draw", lambda names, data, out, full: (
        out / "fig03.md").write_text("# Figure 3\n"))
    folders = ["--data", str(tmp_path / "data"), "--out", str(tmp_path / "out")]
    assert command.main(["--only", "fig03", *folders]) == 0
    assert {"fig03.md", "index.md"} <= set(described(tmp_path / "out"))
    assert crate.faults(tmp_path / "out") == []
    made = "".join(f"figures: made the folder {tmp_path / name}\n" for name in ("data", "out"))
    assert capsys.readouterr().err == made
    assert command.main(["--only", "fig03", *folders]) == 0
    assert not capsys.readouterr().err
