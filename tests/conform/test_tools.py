"""Tests of the conformance suite's tools: the export of cases, the reader of exported cases,
minimal cases, strategies of hypothesis, the chart, the page and the command."""
from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from gpgpu_rt import reference
from gpgpu_rt.cli.main import main
from gpgpu_rt.conform import read_cases, strategies
from gpgpu_rt.conform.answers import EngineAnswers
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.export import READER, SCHEMA, export
from gpgpu_rt.conform.page import page
from gpgpu_rt.conform.shrink import Minimal, shrink
from gpgpu_rt.conform.suite import KINDS, Known, Row

# Verdict of the suite -> verdict of the exported reader, for verdicts that the reader names
# differently. The reader knows no geometry, so it distinguishes fewer verdicts.
READER_NAMES = {"undecidable": "right", "false hit": "wrong triangle",
                "wrong nearest": "wrong triangle", "not finite": "wrong t"}


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("suite")
    assert list(export(folder, ["sphere-edges", "intervals", "coincident"], 40, 1)) == [
        "sphere-edges", "intervals", "coincident"]
    return folder


@pytest.mark.parametrize("name", ["sphere-edges", "intervals", "coincident"])
def test_both_files_have_the_same_content(exported: Path, name: str) -> None:
    told = json.loads((exported / f"{name}.json").read_text())
    known = Known.of(name, 40, 1)
    with np.load(exported / f"{name}.npz") as arrays:
        for one in ("triangles", "origins", "directions"):
            assert arrays[one].dtype == np.float32
            assert np.float32(told[one]).tobytes() == arrays[one].tobytes() == \
                getattr(known.case, one).tobytes()
        for one in ("exact_triangle", "must_hit", "may_hit", "copy_of"):
            assert told[one] == arrays[one].tolist()
        entries = [entry for entries in told["acceptable"] for entry in entries]
        assert [entry[0] for entry in entries] == arrays["triangle"].tolist()
        assert [entry[2] for entry in entries] == arrays["t_high"].tolist()
    assert set(json.loads((exported / SCHEMA).read_text())["required"]) == set(told)


@pytest.mark.parametrize("seed", range(4), ids="seed{}".format)
@pytest.mark.parametrize("name", ["sphere-edges", "intervals", "coincident"])
def test_the_reader_judges_as_the_suite_does(exported: Path, tmp_path: Path, name: str,
                                             seed: int) -> None:
    """The reader and the suite judge answers alike. The test makes the answers by random changes
    of some right answers."""
    known, rng = Known.of(name, 40, 1), np.random.default_rng(seed)
    exact = known.answers.exact
    triangle, t = exact.triangle.copy(), exact.t.copy()
    spoilt = rng.random(40) < 0.5
    triangle[spoilt] = rng.integers(-1, len(known.case.triangles), spoilt.sum())
    t[rng.random(40) < 0.2] *= 1.5
    verdicts = known.judge(EngineAnswers(triangle, t), slice(None))
    words = [reference.KINDS[kind] for kind in verdicts.kind]
    family = read_cases.load(exported / f"{name}.json")
    told = read_cases.judge(family, triangle.tolist(), t.tolist())
    assert told == [READER_NAMES.get(word, word) for word in words]
    answers = tmp_path / "answers.json"
    answers.write_text(json.dumps({"triangle": triangle.tolist()}))
    done = subprocess.run([sys.executable, exported / READER, exported / f"{name}.json", answers],
                          capture_output=True, text=True, check=True)
    assert "right" in done.stdout


def test_shrinking_keeps_the_fault() -> None:
    """`shrink` finds a case of one triangle that still fails.

    Here a case fails if its ray has a hit and a triangle lies near `lost`. `lost` is the centre of
    the triangle that the ray hits before the case is reduced.
    """
    known = Known.of("sphere-random", 300, 1)
    ray = int(np.flatnonzero(known.answers.exact.triangle >= 0)[0])
    case = known.case.part(slice(ray, ray + 1))
    lost = case.triangles[known.answers.exact.triangle[ray]].mean(axis=0)

    def fails(one: Case) -> bool:
        near = np.abs(one.triangles.mean(axis=1) - lost).max(axis=1) < 0.05
        return bool(near.any()) and bool(reference.trace(one.triangles, *one.rays).hit[0])
    small = shrink(case, fails)
    assert fails(small) and len(small.triangles) == 1
    text = Minimal("an engine", "1.0", "sphere-random", "leak", small,
                   EngineAnswers(np.array([-1]))).to_python()
    names: dict[str, object] = {}
    exec(text, names)
    assert np.array_equal(names["triangles"], small.triangles)
    assert np.array_equal(names["direction"], small.directions[0])
    assert "the engine says a miss" in text and names["t_max"] == np.inf


@settings(max_examples=25)
@given(strategies.cases(most_rays=8))
def test_strategies_make_cases(case: Case) -> None:
    assert len(case.origins) <= 8 and not case.t_min.any()
    hits = reference.trace(case.triangles, case.origins, case.directions, accelerated=True)
    assert not reference.check(case.triangles, case.origins, case.directions, hits.t,
                               hits.triangle).wrong.any()


def test_names_cannot_inject_markup() -> None:
    row = Row("<script>x</script>", "1", "one-triangle", 3, 0,
              {**dict.fromkeys(KINDS, 0), "crash": 3}, 0.1, note='"><b>')
    text = page([row], {"<i>": "<u>"})
    assert not any(tag in text for tag in ("<script", "<b>", "<i>", "<u>"))


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    chart, html = tmp_path / "chart.png", tmp_path / "page.html"
    pytest.importorskip("matplotlib")
    assert main(["conform", "-m", "brute-force", "--engine", "none", "--family",
                 "one-triangle,box-edges", "--rays", "20", "--plot", str(chart), "--page",
                 str(html)]) == 0
    assert "box-edges     0" in capsys.readouterr().out
    assert chart.stat().st_size > 1000 and "box-edges" in html.read_text()
    assert main(["conform", "-m", "brute-force", "--engine", "none", "--family", "intervals",
                 "--rays", "20", "--json"]) == 0
    row, = json.loads(capsys.readouterr().out)
    assert row["engine"] == "brute-force" and row["rays"] == 20
    assert set(row["wrong"]) == set(KINDS) and not any(row["wrong"].values())


def test_the_command_exports_and_lists(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["conform", "--export", str(tmp_path / "suite"), "--family", "one-triangle",
                 "--rays", "5"]) == 0
    assert sorted(path.name for path in (tmp_path / "suite").iterdir()) == [
        "index.json", "one-triangle.json", "one-triangle.npz", READER, SCHEMA]
    assert main(["conform", "--export", str(tmp_path / "suite"), "--family", "box-edges",
                 "--rays", "5"]) == 0
    index = json.loads((tmp_path / "suite" / "index.json").read_text())
    assert [one["family"] for one in index["families"]] == ["box-edges", "one-triangle"]
    assert main(["conform", "--list"]) == 0
    assert "embree-vertices" in capsys.readouterr().out


@pytest.mark.parametrize("words, message", [
    (["--family", "sphere-edge"], "no family 'sphere-edge'; did you mean"),
    (["--rays", "0"], "--rays 0 judges nothing"),
    (["--time-limit", "0"], "--time-limit 0 leaves no time"),
    (["--seed", "-1"], "--seed -1 is negative"),
    (["--engine", "embre"], "no engine 'embre'"),
    (["--engine", "mine"], "for your own function give MODULE:FUNCTION"),
    (["--engine", "mine.py:trace"], "no module 'mine.py' in Python's path or in this folder; give "
     "the name without .py"),
    (["-m", "kd-restar"], "kd-restar"),
    (["-m", "none", "--engine", "none"], "nothing to run"),
    (["--command", "./tracer"], "lacks {cases}"),
    (["--export", "FILE"], "is not a folder"),
    (["--plot", "chart.xyz", "-m", "brute-force", "--engine", "none"], "must end in .png")])
def test_mistakes_get_one_line(tmp_path: Path, capsys: pytest.CaptureFixture, words: list[str],
                               message: str) -> None:
    (tmp_path / "FILE").write_text("")
    words = [str(tmp_path / word) if word == "FILE" else word for word in words]
    assert main(["conform", *words]) == 1
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1, error


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Writes a user's module to a folder, makes this folder the working directory, and returns the
    module's name."""
    (tmp_path / "own_tracer.py").write_text(
        "import numpy as np\nno_function = 3\n"
        "def indices(triangles, origins, directions):\n    return np.full(len(origins), -1)\n"
        "def three(triangles, origins, directions):\n    return [1, 2, 3]\n")
    monkeypatch.chdir(tmp_path)
    return "own_tracer"


@pytest.mark.parametrize("name, why", [
    ("gone", "AttributeError: module 'own_tracer' has no attribute 'gone'"),
    ("no_function", "TypeError: no_function has the type int and is no function")])
def test_a_function_that_cannot_be_loaded_ends_the_command_at_once(
        own: str, capsys: pytest.CaptureFixture, name: str, why: str) -> None:
    assert main(["conform", "-m", "brute-force", "--engine", f"{own}:{name}"]) == 1
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"gpgpu-rt: --engine '{own}:{name}' cannot be loaded ({why}); give "
                          "MODULE:FUNCTION\n")


@pytest.mark.parametrize("name, what", [("indices", "ndarray of shape (5,)"),
                                        ("three", "list of 3")])
def test_a_function_that_returns_something_else_is_told_what_to_return(
        own: str, capsys: pytest.CaptureFixture, name: str, what: str) -> None:
    assert main(["conform", "-m", "none", "--engine", f"{own}:{name}", "--family", "box-edges",
                 "--rays", "5"]) == 0
    assert (f"{own}:{name}, box-edges: ValueError: {own}:{name} must return (t, triangle), two "
            f"arrays with an entry for each ray; it returned {what}\n") in capsys.readouterr().out
