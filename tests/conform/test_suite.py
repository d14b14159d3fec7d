"""Checks the conformance suite: verdicts are right, crashes and hangs of engines are counted, and
this project's methods answer no ray wrongly."""
from __future__ import annotations

import importlib.util
import re
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli, reference
from gpgpu_rt.conform.answers import EngineAnswers
from gpgpu_rt.conform.case import FAMILIES
from gpgpu_rt.conform.engines import ENGINES
from gpgpu_rt.conform.page import page as page_of
from gpgpu_rt.conform.runner import Crash, Runner
from gpgpu_rt.conform.spec import COMMAND, ENGINE, FUNCTION, METHOD, Spec
from gpgpu_rt.conform.suite import CRASH, Known, notes_of, run
from gpgpu_rt.reference.verdicts import (
    ANY_HIT_DISAGREES, FALSE_HIT, LEAK, NOT_FINITE, RIGHT, UNDECIDABLE, WRONG_NEAREST, WRONG_T
)

METHODS = [(row.name, schedule) for row in rt.methods() for schedule in row.schedules]
# In these families, rays go through long lists of triangles or boxes. Schedules other than `loop`
# need a pass for each entry of a list.
LONG_LISTS = ("coincident", "coplanar", "one-centroid", "long-way")

# Two parallel triangles, and three rays: through the middle of both triangles, past both, and
# through an edge of each triangle.
TWO = np.float32([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[-1, -1, -1], [1, -1, -1], [0, 1, -1]]])
ORIGINS = np.float32([[0, 0, 2], [5, 5, 2], [0, -1, 2]])
DIRECTIONS = np.float32([[0, 0, -1]] * 3)


def wrong(method: str, schedule: str, name: str, rays: int) -> dict[str, int]:
    """Return kind -> number of rays, for each kind of wrong answer that occurs."""
    known = Known.of(name, rays)
    answers = Spec(METHOD, method, schedule).load()(known.case)
    verdicts = known.judge(answers, slice(None))
    return {kind: count for kind, count in verdicts.counts.items()
            if count and kind not in ("right", "undecidable")}


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("method", ["brute-force", "bvh-packet"])
def test_no_ray_is_wrong(method: str, name: str) -> None:
    assert not wrong(method, "", name, 100)


@pytest.mark.full
@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("method, schedule", METHODS)
def test_no_ray_is_wrong_in_full(method: str, schedule: str, name: str) -> None:
    if name in LONG_LISTS and schedule != "loop":
        pytest.skip("this schedule takes a pass for each entry of a long list")
    assert not wrong(method, schedule, name, 1000)


@pytest.mark.parametrize("triangle, t, any_hit, kinds", [
    pytest.param((0, -1, 0), (2, np.inf, 2), (1, 0, 1), (RIGHT, RIGHT, UNDECIDABLE), id="right"),
    pytest.param((0, -1, -1), (2, np.inf, 2), (1, 0, 0), (RIGHT, RIGHT, UNDECIDABLE), id="edge"),
    pytest.param((-1, -1, -1), None, None, (LEAK, RIGHT, UNDECIDABLE), id="leak"),
    pytest.param((0, 0, -1), None, None, (RIGHT, FALSE_HIT, UNDECIDABLE), id="false-hit"),
    pytest.param((0, 7, -1), None, None, (RIGHT, FALSE_HIT, UNDECIDABLE), id="no-triangle"),
    pytest.param((1, -1, -1), (3, 0, 0), None, (WRONG_NEAREST, RIGHT, UNDECIDABLE), id="nearest"),
    pytest.param((0, -1, -1), (2.01, 0, 0), None, (WRONG_T, RIGHT, UNDECIDABLE), id="t"),
    pytest.param((0, -1, -1), (np.nan, 0, 0), None, (NOT_FINITE, RIGHT, UNDECIDABLE), id="nan"),
    pytest.param((0, -1, -1), (np.inf, 0, 0), None, (NOT_FINITE, RIGHT, UNDECIDABLE), id="inf"),
    pytest.param((0, -1, -1), None, (0, 1, 1),
                 (ANY_HIT_DISAGREES, ANY_HIT_DISAGREES, UNDECIDABLE), id="any-hit"),
])
def test_verdicts(triangle, t, any_hit, kinds) -> None:
    found = reference.check(TWO, ORIGINS, DIRECTIONS,
                            None if t is None else np.array(t, float), np.array(triangle),
                            None if any_hit is None else np.array(any_hit, bool))
    assert found.kind.tolist() == list(kinds)
    assert found.wrong.tolist() == [kind >= LEAK for kind in kinds]


def test_how_much_an_answer_is_wrong() -> None:
    found = reference.check(TWO, ORIGINS, DIRECTIONS, np.array([2.5, 0, 2]), [0, -1, 0])
    assert found.t_error[0] == pytest.approx(0.5) and np.isnan(found.t_error[1])
    assert 0 < found.t_allowed[0] < 1e-4


def test_a_miss_between_two_triangles_is_a_leak() -> None:
    """A ray meets the common edge of two triangles. Neither hit is certain, but all rays in a ring
    around the ray hit a triangle, so a miss is a leak. With a gap between the two triangles, a
    miss is no leak."""
    quad = np.float32([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    known = reference.acceptance(quad, [[0.5, 0.5, 1]], [[0, 0, -1]])
    assert known.must_hit[0] and known.triangle.tolist() == [0, 1]
    gap = quad + np.float32([[[1e-3, -1e-3, 0]], [[0, 0, 0]]])
    known = reference.acceptance(gap, [[0.5, 0.5, 1]], [[0, 0, -1]])
    assert not known.must_hit[0] and known.may_hit[0]


def test_swapped_answers_are_named() -> None:
    with pytest.raises(ValueError, match="are t and triangle swapped"):
        reference.check(TWO, ORIGINS, DIRECTIONS, [0, -1, 0], [2.5, 0, 2])


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(ValueError, match=r"triangle has shape \(2,\); expected \(3,\)"):
        reference.check(TWO, ORIGINS, DIRECTIONS, None, np.array([0, 1]))


@pytest.fixture
def engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that writes a module of engines and returns the spec of an engine."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)

    def write(text: str, name: str = "trace") -> Spec:
        (tmp_path / "my_engine.py").write_text(textwrap.dedent(text))
        return Spec(FUNCTION, f"my_engine:{name}")
    return write


@pytest.mark.parametrize("body, reason", [
    ("raise ValueError('not\\ntoday')", "ValueError: not today"),
    ("import os; os._exit(3)", "the process ended with status 3"),
    ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "status -11"),
    ("import os; os.write(2, b'well\\nfree(): bad chunk\\n'); os.abort()",
     "status -6: free(): bad chunk"),
    ("import time; time.sleep(60)", "no answer within 2 s"),
    ("return None", "must return (t, triangle)")])
def test_a_crash_is_counted(engine, body: str, reason: str) -> None:
    spec = engine(f"""
        def trace(triangles, origins, directions):
            {body}
        """)
    case = Known.of("one-triangle", 4).case
    with Runner(seconds=2) as runner:
        with pytest.raises(Crash, match=reason.replace("(", r"\(").replace(")", r"\)")):
            runner.trace(spec, case)
        # After a crash, the runner traces again. If its process has ended, the runner starts a new
        # process. The hanging engine skips this check.
        answers, _ = runner.trace(Spec(METHOD, "brute-force"), case) if "60" not in body else (
            EngineAnswers(np.zeros(4)), 0)
        assert len(answers.triangle) == 4


@pytest.mark.parametrize("body, note", [
    ("raise RuntimeError('broken')", "RuntimeError: broken"),
    ("return 0.5 + origins[:, 0], 0.5 + origins[:, 1]",
     "triangle must hold integers; are t and triangle swapped?"),
    ("return origins, origins", "ValueError: t has shape (5, 3); expected (5,)")])
def test_a_crash_makes_a_row(engine, body: str, note: str) -> None:
    spec = engine(f"""
        def trace(triangles, origins, directions):
            print("noise of an engine")
            {body}
        """)
    row, = run([spec], ["one-triangle"], 5)
    assert row.wrong[CRASH] == row.rays == 5 and row.note == note
    assert row.failure == CRASH


def test_an_engine_that_hangs_is_not_run_again(engine, capsys) -> None:
    spec = engine("""
        import time

        def trace(triangles, origins, directions):
            time.sleep(60)
        """)
    first, second = run([spec], ["one-triangle", "sphere-random"], 5, seconds=2)
    assert first.wrong[CRASH] == 5 and first.note == "no answer within 2 s"
    assert second.rays == 0 and "no answer in one-triangle" in second.note
    assert [row.failure for row in (first, second)] == ["no answer", ""]
    assert page_of([first, second], {}).count(">no answer</td>") == 1
    assert cli.main(["conform", "-m", "none", "--engine", spec.name, "--family", "one-triangle",
                     "--rays", "5", "--time-limit", "1"]) == 0
    assert re.search("^one-triangle +no answer$", capsys.readouterr().out, re.MULTILINE)


@pytest.mark.parametrize("body, reason", [
    ("import no_such_library", "ModuleNotFoundError: No module named 'no_such_library'"),
    ("import os; os._exit(3)", "the process ended with status 3")])
def test_an_engine_that_cannot_be_loaded_has_no_wrong_rays(
        body: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    """An installed package may lack a library of the system. Then the engine's rays do not count
    as crashes."""
    (tmp_path / "embreex").mkdir()
    (tmp_path / "embreex" / "__init__.py").write_text(body)
    (tmp_path / "embreex" / "mesh_construction.py").touch()
    (tmp_path / "embreex" / "rtcore_scene.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    rows = list(run([Spec(ENGINE, "embreex")], ["one-triangle", "sphere-random"], 5))
    assert all((row.rays, row.wrong_rays) == (0, 0) for row in rows)
    assert notes_of(rows, {"vtk": "not installed"}) == [
        f"embreex was not run, because it cannot be loaded: {reason}",
        "vtk was not run: not installed"]
    assert cli.main(["conform", "-m", "none", "--engine", "embreex", "--family", "one-triangle",
                     "--check"]) == 1
    assert "--check could not run embreex" in capsys.readouterr().err
    page = page_of(rows, {})
    assert page.count("it cannot be loaded: ") == 1 and ">crash</td>" not in page


def test_a_function_is_judged(engine) -> None:
    spec = engine("""
        import numpy as np
        from gpgpu_rt import reference

        def trace(triangles, origins, directions):
            hits = reference.trace(triangles, origins, directions)
            return hits.t * np.where(np.arange(len(hits.t)) == 0, 1.5, 1), hits.triangle
        """)
    rows = list(run([spec], ["sphere-random", "intervals"], 20))
    assert rows[0].wrong["wrong t"] == rows[0].wrong_rays == 1
    assert rows[1].rays == 0 and "t_min or t_max" in rows[1].note


def test_a_program_is_judged(tmp_path: Path) -> None:
    program = tmp_path / "tracer.py"
    program.write_text(textwrap.dedent("""
        import json, sys
        import numpy as np
        from gpgpu_rt import reference
        case = json.load(open(sys.argv[1]))
        ends = [np.array([np.inf if end is None else end for end in case[name]])
                for name in ("t_min", "t_max")]
        hits = reference.trace(case["triangles"], case["origins"], case["directions"], *ends)
        json.dump({"triangle": hits.triangle.tolist(),
                   "t": [float(t) if hit else None for t, hit in zip(hits.t, hits.hit)],
                   "any_hit": hits.hit.tolist()}, open(sys.argv[2], "w"))
        """))
    spec = Spec(COMMAND, f"{sys.executable} {program} {{cases}} {{answers}}")
    rows = list(run([spec], ["segments", "intervals"], 30))
    assert [row.rays for row in rows] == [30, 30] and not any(row.wrong_rays for row in rows)


@pytest.mark.parametrize("spec, message", [
    (lambda: Spec(ENGINE, "embrex"), "no engine 'embrex'; did you mean embreex"),
    (lambda: Spec(COMMAND, "./tracer {cases}"), "lacks {answers}"),
    (lambda: Spec.of("module:"), "MODULE:FUNCTION"),
    (lambda: Spec(METHOD, "kd-stack", "step"), "runs under loop only")])
def test_wrong_specs_are_named(spec, message: str) -> None:
    with pytest.raises(rt.Error, match=message):
        spec()


@pytest.mark.parametrize("name", ENGINES)
def test_every_installed_engine_answers(name: str) -> None:
    """Each adapter returns an engine's answers as the suite's triangle indices and t. So rays that
    are aimed inside triangles get right answers."""
    engine = ENGINES[name]
    if any(importlib.util.find_spec(module) is None for module in engine.modules):
        pytest.skip(engine.missing)
    rows = list(run([Spec(ENGINE, name)], ["sphere-random", "outside"], 60))
    assert not any(row.wrong_rays for row in rows), rows
    assert all(row.rays == 60 and row.version for row in rows)


QUAD = np.float32([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
WALL = np.float32([[[-9, -9, -1], [9, -9, -1], [0, 9, -1]]])


def test_a_wall_behind_an_edge_is_no_excuse() -> None:
    """A ray through the diagonal of a square must hit the square. It is wrong to report the wall
    behind the square instead, although only the wall's hit is certain."""
    rays = np.concatenate([QUAD, WALL]), [[0.5, 0.5, 1]], [[0, 0, -1]]
    assert reference.acceptance(*rays).triangle.tolist() == [0, 1]
    assert reference.check(*rays, [2.0], [2]).kind.tolist() == [WRONG_NEAREST]


@pytest.mark.parametrize("what, second", [
    ("two depths", QUAD[1:] - np.float32([0, 0, 0.25])),
    ("a T-junction", np.float32([[[-1, -1, 0], [0.6, 0.6, 0], [-1, 1, 0]],
                                 [[0.6, 0.6, 0], [1, 1, 0], [-1, 1, 0]]]))])
def test_edges_that_only_seem_to_meet_prove_no_leak(what: str, second: np.ndarray) -> None:
    """All rays in a ring around the ray hit triangles, but these triangles have no common edge."""
    known = reference.acceptance(np.concatenate([QUAD[:1], second]), [[0.5, 0.5, 1]], [[0, 0, -1]])
    assert known.may_hit[0] and not known.must_hit[0]


@pytest.mark.parametrize("length", [1e-42, 1e-30, 1, 1e30, 3e38])
def test_the_length_of_a_direction_changes_no_verdict(length: float) -> None:
    directions = np.float32([[0, 0, -1]]) * np.float32(length)
    for triangles, must in ((QUAD, True), (QUAD[:1], False)):
        known = reference.acceptance(triangles, [[0.5, 0.5, 1]], directions)
        fits = 1 / length < 3e38    # otherwise t overflows float32, and a miss is right, too
        assert known.must_hit[0] == (must and fits)


def test_a_scene_without_triangles() -> None:
    none = np.zeros((0, 3, 3))
    assert reference.check(none, [[0, 0, 0]], [[0, 0, 1]], None, [-1]).kind.tolist() == [RIGHT]
    assert reference.check(none, [[0, 0, 0]], [[0, 0, 1]], None, [3]).kind.tolist() == [FALSE_HIT]
