"""The instructions of docs/how-to/add-a-method.md work: the page's commands and the project's
tests find a method in a user's own folder."""
from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import soup_scene
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.gl.record import FIELD_TYPES
from gpgpu_rt.methods.plugins import MOST_STATE_TEXELS, rows_of
from gpgpu_rt.rays import ray_sets
from gpgpu_rt.rays.records import COUNTERS, HIT
from gpgpu_rt.traversal.records import STATE
from gpgpu_rt.traversal.triangle_table import TRIANGLE

ROOT = Path(rt.__file__).parents[1]
TEXT = (ROOT / "docs" / "how-to" / "add-a-method.md").read_text()
METHODS = ROOT / "examples" / "methods"
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.S)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a copy of the example's folder; the copy's name contains a space."""
    return Path(shutil.copytree(METHODS, tmp_path / "my methods"))


def python(*arguments: str, cwd: Path | None = None, **environment: str
           ) -> subprocess.CompletedProcess:
    """Run Python in another process, so that this process's method table does not change."""
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=cwd,
                          env={**os.environ, **environment})


def test_quoted_code_is_in_the_files() -> None:
    """Each block of Python or GLSL on the page is a part of the example's files."""
    files = "".join(path.read_text() for path in METHODS.iterdir() if path.is_file())
    quoted = [text for language, text in BLOCKS if language in ("python", "glsl")]
    assert len(quoted) >= 4
    for text in quoted:
        assert text in files, text


def test_the_page_s_commands_run(folder: Path, tmp_path: Path) -> None:
    """The page's first commands succeed with a copy of the example's folder."""
    lines = next(text for language, text in BLOCKS if language == "sh").splitlines()
    assert len(lines) == 3
    for line in lines:
        words = [str(folder) if word == "examples/methods" else word for word in
                 shlex.split(line)[1:]]
        answer = python("-m", "gpgpu_rt", *words, cwd=tmp_path)
        assert answer.returncode == 0, answer.stderr
    assert "sweep" in python("-m", "gpgpu_rt", "methods", GPGPU_RT_METHODS=str(folder)).stdout
    for name, size in (("sweep.png", (64, 64)), ("heat.png", None)):
        with Image.open(tmp_path / name) as image:
            assert size is None or image.size == size
            assert len(np.unique(np.asarray(image.convert("L")))) > 10


def test_the_page_about_kernels_has_the_right_names() -> None:
    """docs/kernel-language.md has the names of the program around a user's file, the types of
    fields and the largest state."""
    page = (ROOT / "docs" / "kernel-language.md").read_text()
    core = "".join(path.read_text() for path in (ROOT / "glsl" / "core").iterdir())
    records = {"hit": HIT, "state": STATE}
    rows = re.findall(r"^\| (`.*?) \|", page, re.M)
    for name in re.findall(r"`([\w.]+)", " ".join(rows)):
        owner, _, field = name.partition(".")
        if owner in records:
            assert field in {one.name for one in records[owner].fields}
        elif name == "triangle_last":
            assert f"int {name}(int i)" in TRIANGLE.table_glsl()
        else:
            assert re.search(rf"\b{field or name}\b", core), name
    counters = {"nodes_visited", "leaves_visited", "triangles_tested"}
    assert set(re.findall(r"`COUNT\((\w+)\)`", page)) == counters - {"triangles_tested"}
    assert counters == {field.name for field in COUNTERS.fields}
    types = page.partition("The types of fields are")[2].partition(". ")[0]
    assert set(re.findall(r"`(\w+)`", types)) == set(FIELD_TYPES)
    state = re.search(r"at most (\d) texels", page)
    in_docstring = re.search(r"at most (\d) texels", str(rt.Method.__doc__))
    assert state is not None and in_docstring is not None
    assert int(state[1]) == int(in_docstring[1]) == MOST_STATE_TEXELS


def test_a_file_written_for_the_former_modules_loads(folder: Path) -> None:
    """A user's file may import modules by the names that they had in version 0.1."""
    path = folder / "sweep.py"
    lines = [line for line in path.read_text().splitlines()
             if not line.startswith("from gpgpu_rt")]
    at = lines.index("import numpy as np") + 1
    lines[at:at] = ["from gpgpu_rt.methods import Accelerator, Method",
                    "from gpgpu_rt.methods.brute_force import box_uniforms, triangle_table",
                    "from gpgpu_rt.options import Option", "from gpgpu_rt.record import Record",
                    "from gpgpu_rt.texel_layout import TRIANGLE"]
    path.write_text("\n".join(lines))
    answer = python("-m", "gpgpu_rt", "--methods-from", str(folder), "methods", "sweep")
    assert answer.returncode == 0 and "sweep" in answer.stdout, answer.stderr


@pytest.mark.once
def test_the_project_s_tests_find_the_method(precise_renderer, folder: Path) -> None:
    """The tests that the page names pass with the example. They also pass with methods that differ
    from the example in structure, state and the columns of Table 1."""
    text = (folder / "sweep.py").read_text()
    for name, structure in (("tree", "build_bvh(triangles)"), ("none", "None")):
        other = text
        for old, new in (("structure=order", f"structure={structure}"),
                         ('name="sweep",', f'name="sweep-{name}", stack=True, restarts=True,'),
                         ("steps:int", "steps:int | node:int more:vec3"),
                         ("import Option\n", "import Option\nfrom gpgpu_rt.methods.bvh.build "
                                             "import build_bvh\n")):
            assert other.count(old) == 1
            other = other.replace(old, new)
        (folder / f"{name}.py").write_text(other)
    command, = (line for _, text in BLOCKS for line in text.splitlines() if "pytest" in line)
    words = shlex.split(command)[2:]
    assert words[-2:] == ["-k", "sweep"]
    if precise_renderer.is_es:      # other folders have tests that need desktop OpenGL
        words[words.index("tests")] = "tests/traversal"
    # Leave out tests/workers/test_sweeps.py, whose name also contains "sweep".
    answer = python(*words[:-1], "sweep and not sweeps", "-q", "-p", "no:cacheprovider", cwd=ROOT,
                    GPGPU_RT_METHODS=str(folder))
    assert answer.returncode == 0, answer.stdout[-3000:]
    fewest = 150 if precise_renderer.is_es else 400
    assert int(re.search(r"(\d+) passed", answer.stdout)[1]) >= fewest


@pytest.mark.full
@pytest.mark.once
def test_the_project_s_tests_fail_for_a_wrong_method(precise_renderer, folder: Path) -> None:
    """The tests fail if a changed method ends its search before the nearest hit."""
    glsl = folder / "sweep.glsl"
    assert "> hit.t)" in glsl.read_text()
    glsl.write_text(glsl.read_text().replace("> hit.t)", "> 0.5 * hit.t)"))
    answer = python("-m", "pytest", "-q", "-m", "not full", "-p", "no:cacheprovider",
                    "tests/traversal/test_hits.py::test_soup_matches_brute_force",
                    "-k", "sweep and eye", cwd=ROOT, GPGPU_RT_METHODS=str(folder))
    assert answer.returncode == 1 and "rays differ" in answer.stdout


LOADED = """
import pickle, sys
import gpgpu_rt as rt
from concurrent.futures import ProcessPoolExecutor
import multiprocessing

def hits(tracer):
    return tracer.trace([[0.2, 0.3, 9.0]], [[0, 0, -1.0]]).triangle.tolist()

if __name__ == "__main__":
    rows = rt.load_methods(sys.argv[1])
    assert [row.name for row in rows] == ["sweep"] and rt.load_methods(sys.argv[1]) == []
    assert rt.methods()[-1].name == "sweep" and len({r.name for r in rt.methods()}) > 20
    scene = rt.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with rt.Tracer(scene, "sweep", axis=1, run=1) as tracer:
        assert hits(tracer) == [0]
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            print(pool.submit(hits, tracer).result())
"""


@pytest.mark.full
def test_a_script_and_its_processes_load_the_method(folder: Path, tmp_path: Path) -> None:
    """After `load_methods`, a script can trace with the method, and so can a process that the
    script starts."""
    script = tmp_path / "loaded.py"
    script.write_text(LOADED)
    answer = python(str(script), str(folder))
    assert answer.returncode == 0 and answer.stdout.strip() == "[0]", answer.stderr


BROKEN = {
    "syntax": ("sweep.py", "def prepare(", "def prepare((", r"sweep.py:\d+: SyntaxError"),
    "import": ("sweep.py", "import numpy as np", "import nunpy", r"sweep.py:\d+: ModuleNotFound"),
    "no rows": ("sweep.py", "ROWS = ", "ROW = ", "has no ROWS"),
    "no row": ("sweep.py", "ROWS = (Method(", "ROWS = (dict(", "has no ROWS"),
    "name": ("sweep.py", 'name="sweep"', 'name="My Sweep"', "words of a-z"),
    "taken": ("sweep.py", 'name="sweep"', 'name="grid"', "exists already"),
    "state": ("sweep.py", "phase:int ", "", "no phase"),
    "kernels": ("sweep.py", '("pass_run", "intersect")', "()", "has 0 kernels"),
    "driver": ("sweep.py", 'name="sweep"', 'name="sweep", drivers={"loop": "sweeps.Sweep"}',
               "no driver 'sweeps.Sweep'"),
    "glsl": ("sweep.py", 'with_name("sweep.glsl")', 'with_name("swep.glsl")', "no GLSL file"),
    "prepare": ("sweep.py", "len(order), length", "len(ordr), length",
                r"sweep.py:\d+: NameError in prepare"),
    "unwidened": ("sweep.py", ", **box_uniforms(triangles)", "", "no scene_hi and no scene_lo"),
    "table": ("sweep.py", "RUN.name:", '"run":', "no table sweep_run"),
    "unset": ("sweep.py", '"run_count": len(first), ', "",
              "sweep.glsl reads the uniform run_count"),
    "rows": ("sweep.py", '"hi": hi,', '"hi": hi[:1],', "rows: lo 2, hi 1,"),
    "word": ("sweep.py", 'Option("run"', 'Option("size"', "option size, but the commands use"),
    "absent": ("sweep.glsl", "void intersect(", "void intrsect(", "glsl has no kernel intersect"),
    "kernel": ("sweep.glsl", "goes_back(ray) ? run_count", "goes_bak(ray) ? run_count",
               r"sweep.glsl:\d+: .*goes_bak"),
}


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=() if name in ("syntax", "kernel", "unset") else pytest.mark.full)
    for name in BROKEN])
def test_a_fault_is_named_in_a_line(folder: Path, tmp_path: Path, name: str) -> None:
    """Each fault in a user's method gives an error message of one line that names the fault."""
    file, text, instead, message = BROKEN[name]
    path = folder / file
    assert text in path.read_text()
    path.write_text(path.read_text().replace(text, instead, 1))
    answer = python("-m", "gpgpu_rt", "--methods-from", str(folder), "render", "cornell", "-m",
                    "sweep", "--size", "8", "-o", str(tmp_path / "x.png"))
    assert answer.returncode == 1 and answer.stderr.count("\n") == 1, answer.stderr
    assert re.search(message, answer.stderr) and str(folder) in answer.stderr
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("text, instead, message", [
    ('state=Record("state",', 'state=None and Record("state",', "state is None; give a Record"),
    ('glsl=Path(__file__).with_name("sweep.glsl")', "glsl=None",
     "glsl is None; give the name of a file"),
    ("prepare=prepare", "prepare=None", "prepare is None; give a function"),
    ("tables=(TRIANGLE, RUN)", "tables=None", "tables is None; give a tuple"),
    ("tables=(TRIANGLE, RUN)", 'tables=("triangle",)',
     "tables holds 'triangle'; give only Records"),
    ("prepare=prepare,", "prepare=prepare, schedules=None,", "schedules is None; give a tuple"),
    ("    options=(\n", "    options=None and (\n", "options is None; give a tuple"),
    ("first:int", "first:itn", "record sweep_run has a field 'first:itn'"),
    ("phase:int", "phase:itn", "record state has a field 'phase:itn'"),
    ("hi:vec3 |", "hi:vec3 more:vec2 |", "record sweep_run: texel 1 has over four"),
    ("steps:int", "steps:int" + " | more:vec4" * 6,
     "the state has 7 texels; at most 6 fit beside the hit and the counters"),
    ('Option("run", 16, "triangles per run", int, minimum=1),\n    )',
     'Option("run", 16, "triangles per run", int, minimum=1))[1]', "options is not a tuple"),
    ('("pass_run", "intersect")', '("pass_run")', "kernels is not a tuple"),
])
def test_a_wrong_value_in_a_row_is_named_in_a_line(folder: Path, text: str, instead: str,
                                                   message: str) -> None:
    """A wrong value in a method's row, or in one of the row's records, gives an error message of
    one line."""
    path = folder / "sweep.py"
    assert text in path.read_text()
    path.write_text(path.read_text().replace(text, instead, 1))
    with pytest.raises(rt.MethodError, match=re.escape(message)) as said:
        rows_of(path)
    assert str(path) in str(said.value) and "\n" not in str(said.value)


@pytest.mark.parametrize("text, instead, message", [
    ('"run_count": len', '"run_cont": len',
     "returns the uniform run_cont, but the GLSL does not declare it; did you mean run_count?"),
    ('"least": np', '"lest": np', "table sweep_run has no field 'lest'; did you mean least?"),
    ('"most": np', '"tables": np',
     "table sweep_run has no field 'tables'; known: first, hi, least, lo, most"),
    ('"hi": hi', '"hi": hi[:, :2]', "field hi of table sweep_run has the shape (2, 2); its type in"
     " the record needs (2, 3)"),
    ('"first": first', '"first": first[0]', "field first of table sweep_run is a single number"),
    ("RUN.name: {", "RUN.name: [] and {", "table sweep_run has no fields; return a dict"),
    ('"first": first', '"first": lo', "field first of table sweep_run has the shape (2, 3); its "
     "type in the record needs (2,)"),
])
def test_a_wrong_accelerator_is_named_in_a_line(folder: Path, text: str, instead: str,
                                                message: str) -> None:
    """A uniform that the GLSL does not declare, or a field that does not fit its record, gives an
    error message of one line."""
    path = folder / "sweep.py"
    assert text in path.read_text()
    path.write_text(path.read_text().replace(text, instead, 1))
    row, = rows_of(path)
    with pytest.raises(rt.MethodError, match=re.escape(message)) as said:
        row.prepare(rt.load_scene("cornell").triangles, row.resolved({}))
    assert f"{path}, method 'sweep': " in str(said.value) and "\n" not in str(said.value)


UPDATED = """
import sys
import gpgpu_rt as rt

if __name__ == "__main__":
    rt.load_methods(sys.argv[1])
    with rt.Tracer("cornell", "sweep") as tracer:
        try:
            next(tracer.updates([tracer.scene.triangles]))
        except rt.MethodError as failure:
            print(failure)
"""


def test_boxes_that_cannot_be_pickled(folder: Path, tmp_path: Path) -> None:
    """`updates` builds an accelerator in another process, which cannot send back a lambda."""
    path, script = folder / "sweep.py", tmp_path / "updated.py"
    path.write_text(path.read_text().replace("structure=order", "boxes=lambda: (lo, hi)"))
    script.write_text(UPDATED)
    answer = python(str(script), str(folder))
    assert answer.stdout.startswith("method sweep builds an accelerator that no"), answer.stderr
    assert "lambda" in answer.stdout and answer.stdout.count("\n") == 1


def test_files_of_one_name_in_two_folders_are_two_modules(folder: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(folder, tmp_path / "others"))
    paths = [one / "sweep.py" for one in (folder, other)]
    for path in paths:
        rows_of(path)
    held = {getattr(module, "__file__", None) for module in list(sys.modules.values())}
    assert {str(path) for path in paths} <= held      # neither module replaced the other


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    answer = python("-m", "gpgpu_rt", "methods", GPGPU_RT_METHODS=str(tmp_path / "gone"))
    assert answer.returncode == 1 and "no folder of methods" in answer.stderr
    assert answer.stderr.count("\n") == 1
    with pytest.raises(rt.MethodError, match="gone"):
        rt.load_methods(tmp_path / "gone")
    (tmp_path / "one.py").write_text("ROWS = ()")
    with pytest.raises(rt.MethodError, match="one.py is a file; give its folder, "):
        rt.load_methods(tmp_path / "one.py")
    assert len(rt.methods()) > 20      # the failed calls changed nothing
    answer = python("-m", "gpgpu_rt", "program", "sweep")
    assert "no method 'sweep'; --methods-from or load_methods loads your own" in answer.stderr


@pytest.mark.parametrize("chip, kind", [("nv40", "int"), ("r420", "int"), ("r420", "pointer")])
def test_no_card_time_is_predicted(folder: Path, tmp_path: Path, chip: str, kind: str) -> None:
    """A user's own method runs in the era form, but no card's compiler has compiled the kernels.
    On a chip with fp24, fields of type pointer remain indices."""
    row = next(path for path in folder.glob("*.py") if "cursor:int" in path.read_text())
    text = row.read_text()
    row.write_text(text.replace("first:int", f"first:{kind}").replace("cursor:int",
                                                                      f"cursor:{kind}"))
    says = "no costs were compiled for a method of your own"
    answer = python("-m", "gpgpu_rt", "render", "cornell", "-m", "sweep", "--methods-from",
                    str(folder), "--era", chip, "--size", "16", "-o", str(tmp_path / "o.png"))
    assert answer.returncode == 0, answer.stderr
    assert says in answer.stdout and (tmp_path / "o.png").is_file()
    script = ("import sys, gpgpu_rt as rt\nfrom gpgpu_rt.hardware.prediction import predict\n"
              "rt.load_methods(sys.argv[1])\n"
              "predict(rt.load_scene('cornell'), 'sweep', 'nv40', size=8)\n")
    assert says in python("-c", script, str(folder)).stderr.splitlines()[-1]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.full)],
                         ids="seed{}".format)
def test_rays_of_the_example_end_early(folder: Path, tmp_path: Path, seed: int) -> None:
    """`sweep` sorts triangles along an axis and cuts the sorted list into runs. A ray with a hit
    can end before it has tested all runs."""
    script = ("import sys, numpy as np, gpgpu_rt as rt\n"
              "rt.load_methods(sys.argv[1])\n"
              "rays = np.load(sys.argv[2])\n"
              "scene = rt.Scene.from_arrays(rays['v'], np.arange(len(rays['v'])).reshape(-1, 3))\n"
              "with rt.Tracer(scene, 'sweep', statistics=True, axis=2, run=4) as tracer:\n"
              "    hits = tracer.trace(rays['o'], rays['d'])\n"
              "    runs = len(tracer.accelerator.structure) / 4\n"
              "print((hits.nodes_visited[hits.hit].mean() / runs))\n")
    scene = soup_scene(600, seed, size=0.1)
    origins, directions = ray_sets.eye_rays(scene, 256)
    np.savez(tmp_path / "rays.npz", v=scene.triangles.reshape(-1, 3), o=origins, d=directions)
    answer = python("-c", script, str(folder), str(tmp_path / "rays.npz"))
    assert answer.returncode == 0, answer.stderr
    assert 0 < float(answer.stdout) < 0.8
