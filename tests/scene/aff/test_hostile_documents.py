"""Broken and hostile AFF files are refused with an error of one line, in little time and memory.
The error names the file, and for a wrong statement also the line number."""
from __future__ import annotations

import os
import re
import time
import warnings
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.disk import budget
from gpgpu_rt.scene.aff.statements import MOST_BLOCKS

TRIANGLE = "p 3 0 0 0 1 0 0 0 1 0\n"
MESH = "m vertices 3 0 0 0 1 0 0 0 1 0\n"


def refusal(path: Path, kind: type[rt.Error] = rt.SceneError) -> str:
    """Return the message with which a file is refused. The message must have one line, begin with
    the file's path and appear within 60 s of processor time."""
    begun = time.process_time()
    with pytest.raises(kind) as caught:
        rt.load_scene(path)
    assert time.process_time() - begun < 60
    message = str(caught.value)
    assert "\n" not in message and message.startswith(str(path)), message
    return message


@pytest.mark.parametrize("text, line, message", [
    ("\n\nq 1 2 3", 3, "no statement is called 'q'"),
    ("polygon 3", 1, "no statement is called 'polygon'"),
    ("{", 1, "no statement is called '{'"),
    ("# one\n}", 2, "} closes no block"),
    (TRIANGLE + "x a {", 2, "the block that opens here is not closed"),
    ("x a\n" + TRIANGLE, 2, "expected {, but found 'p'"),
    ("x", 1, "expected the name of a transform, but the file ends"),
    ("xs 1 1 1 0 0 1 0 0 0\n{ }", 2, "'{' is no number"),
    ("p 3\n0 0 0\n1 0 zero\n0 1 0", 3, "'zero' is no number"),
    ("p 3\n0 0 0\n1 0 nan\n0 1 0", 3, "'nan' is not finite"),
    ("p 3\n0 0 0\n1 0 -inf\n0 1 0", 3, "'-inf' is not finite"),
    ("p 3\n0 0 0\n1 0 1e999\n0 1 0", 3, "'1e999' is not finite"),
    ("p 3\n0 0 0\n1 0 0\n0 1 " + "0" * 70, 4, "is no number"),
    ("p 3\n0 0 0 1 0 0", 1, "declares 3 vertices, but only 6 words follow"),
    ("p 1000000000\n0 0 0", 1, "declares 1,000,000,000 vertices, but only 3 words follow"),
    ("p -1\n0 0 0", 1, "declares -1 vertices; give 0 or more"),
    ("p 2 0 0 0 1 1 1", 1, "a polygon has 2 vertices"),
    ("p 3.5 0 0 0", 1, "'3.5' is no whole number"),
    ("p 99999999999999999999 0 0 0", 1, "'99999999999999999999' is no whole number"),
    ("p " + "9" * 9999, 1, "is no whole number"),
    (MESH + "normals\n1000000000\n0 0 1", 3, "declares 1,000,000,000 normals"),
    (MESH + "triangles 1000000000 0 1 2", 2, "declares 1,000,000,000 triangles"),
    (MESH + "triangles 2\n0 1 2\n1 2 3", 4, "a triangle names vertex 3, but the mesh has only 3"),
    (MESH + "triangles 1\n0 1 -1", 3, "a triangle names vertex -1"),
    (MESH + "normals 1 0 0 1\ntriangles 1\n0 1 2  0 0 1", 4, "a triangle names normal 1"),
    (MESH + "texturecoords 1 a.png 0 0\ntriangles 1\n0 1 2  0 1 0", 4,
     "a triangle names texture coordinate 1, but the mesh has only 1"),
    (MESH + "triangles 1\n0 1", 2, "declares 1 triangles, but only 2 words follow"),
    (MESH + "colours 2", 2, "expected normals or texturecoords or triangles, but found 'colours'"),
    (MESH, 1, "expected normals or texturecoords or triangles, but the file ends"),
    ("k a { rot 3 " + "0 " * 24 + "}", 1, "rot has 3 key frames; give 4 or more"),
    ("k a { visibility 0 }", 1, "visibility has 0 key frames; give 1 or more"),
    ("k a {\nspin 4 }", 2, "expected transl or rot or scale or visibility, but found 'spin'"),
    ("k a { rot 1000000000 0 }", 1, "declares 1,000,000,000 key frames"),
    ("k a { visibility 1 0 1\nvisibility 1 0 1 }", 2, "visibility stands twice"),
    ("k a { visibility 1 0 1", 1,
     "expected transl or rot or scale or visibility, but the file ends"),
    ("a 0 1 0", 1, "the animation has 0 frames"),
    ("a 0 1 2.5", 1, "'2.5' is no whole number"),
    ("tpa 0", 1, "an animated triangle has no times"),
    ("tpa 2 1" + " 0" * 18 + "\n0.5" + " 0" * 18, 2, "the times of an animated triangle go back"),
    ("c 1 2 3 1\n1 2 3 1", 1, "the two ends of a cone coincide"),
    ("\nl 0 0 0 -1 0 0", 2, "light: intensity is [-1.0, 0.0, 0.0]"),
    ("v from 1 2 3 at 1 2 3 up 0 1 0 angle 40 hither 1 resolution 5 5", 1,
     "camera: eye and target are both"),
    ("v from 1 2 3 at 1 2 0 up 0 1 0 angle 400 hither 1 resolution 5 5", 1, "fov is 400"),
    ("b -1 0 0\n" + TRIANGLE, 1, "background"),
    ("i 0", 1, "expected the name of a file, but the file ends"),
    ("i 0\ngone.aff", 1, "includes gone.aff, but there is no such file"),
    ("\ni 0 ../a.aff", 2, "includes ../a.aff, which lies outside of the folder"),
    ("i 0 /etc/passwd", 1, "includes /etc/passwd, which lies outside of the folder"),
    ("i 0 sub/../../../etc/passwd", 1, "which lies outside of the folder"),
    ("i 0 b\0.aff", 1, "whose name no file can have"),
    ("i 0 a.aff", 1, "includes a.aff, which includes this file"),
    ("i 0 .", 1, "includes ., which"),
])
def test_each_mistake_names_its_line(text: str, line: int, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.aff"
    path.write_text(text)
    said = refusal(path)
    assert f"{path}, line {line}: " in said and message in said


def test_a_mistake_in_an_included_file_names_that_file(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text("i 0 parts/b.aff")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "b.aff").write_text("\n\np 3 0 0 0")
    said = refusal(tmp_path / "a.aff")
    assert f"{tmp_path / 'parts' / 'b.aff'}, line 3: declares 3 vertices" in said


@pytest.mark.parametrize("text", ["", "l 0 0 0\n", "k a { visibility 1 0 1 }", "# p 3"])
def test_files_without_triangles(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text(text)
    assert "has no triangles" in refusal(tmp_path / "a.aff") or not text


@pytest.mark.parametrize("text", [
    "xs 1e300 1 1 0 0 1 0 0 0 0 { xs 1e300 1 1 0 0 1 0 0 0 0 {" + TRIANGLE + "}}",
    "p 3 0 0 0 1e200 0 0 0 1 0",
    f"x a {{ {TRIANGLE} }} k a {{ transl 4 {'0 1e308 -1e308 0 0 0 0 ' * 4} }}"])
def test_overflow(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text(text)
    assert "a vertex of a is not finite in float32" in refusal(tmp_path / "a.aff")


def test_normals_that_overflow_are_replaced_by_the_triangles(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text(
        "xs 1e200 1e200 1 0 0 1 0 0 0 0 { pp 3 0 0 0 1 0 0 1e-200 0 0 1 0 0 0 1e-200 0 1 0 0 }")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = rt.load_scene(tmp_path / "a.aff")
    assert scene.normals[0].tolist() == [[0, 0, 1]] * 3


def test_a_circle_of_files(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text(TRIANGLE + "i 0 b.aff")
    (tmp_path / "b.aff").write_text("\ni 0 c.aff")
    (tmp_path / "c.aff").write_text("i 0 b.aff")
    assert f"{tmp_path / 'c.aff'}, line 1: includes b.aff, which includes this file" in refusal(
        tmp_path / "a.aff")


def test_a_link_out_of_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "secret.aff").write_text(TRIANGLE)
    (folder / "a.aff").write_text("i 0 b.aff")
    (folder / "b.aff").symlink_to(tmp_path / "secret.aff")
    assert "b.aff, which lies outside of the folder" in refusal(folder / "a.aff")
    (folder / "b.aff").unlink()
    (folder / "b.aff").symlink_to("b.aff")
    assert "line 1: includes b.aff, " in refusal(folder / "a.aff")
    (folder / "b.aff").unlink()
    (folder / "c.aff").write_text(TRIANGLE)
    (folder / "b.aff").symlink_to("c.aff")
    assert len(rt.load_scene(folder / "a.aff")) == 1
    (tmp_path / "linked").symlink_to(folder)
    assert len(rt.load_scene(tmp_path / "linked" / "a.aff")) == 1


@pytest.mark.parametrize("included", [False, True])
def test_fifos_and_folders(included: bool, tmp_path: Path) -> None:
    name = "b.aff" if included else "a.aff"
    (tmp_path / "a.aff").write_text("i 0 b.aff") if included else None
    os.mkfifo(tmp_path / name)
    assert "a FIFO" in refusal(tmp_path / "a.aff")
    (tmp_path / name).unlink()
    (tmp_path / name).mkdir()
    assert "a folder" in refusal(tmp_path / "a.aff")
    (tmp_path / name).rmdir()
    assert "no such file" in refusal(tmp_path / "a.aff")


@pytest.mark.parametrize("block", ["x a {", "xs 1 1 1 0 0 1 0 0 0 0 {"])
def test_blocks_inside_each_other(block: str, tmp_path: Path) -> None:
    def nested(count: int) -> str:
        return f"{block}\n" * count + TRIANGLE + "}" * count
    (tmp_path / "a.aff").write_text(nested(MOST_BLOCKS))
    assert len(rt.load_scene(tmp_path / "a.aff")) == 1
    (tmp_path / "a.aff").write_text(nested(100_000))
    assert f"line {MOST_BLOCKS + 1}: more than 1,000 blocks are open" in refusal(
        tmp_path / "a.aff")


def test_a_long_chain_of_files(tmp_path: Path) -> None:
    for k in range(2000):
        (tmp_path / f"{k}.aff").write_text(f"i 0 {k + 1}.aff")
    (tmp_path / "2000.aff").write_text(TRIANGLE)
    assert len(rt.load_scene(tmp_path / "0.aff")) == 1


@pytest.mark.parametrize("leaf", [TRIANGLE, "l 0 0 0\n", "x a { }", "s 0 0 0 1", ""])
def test_a_bomb_of_includes(leaf: str, tmp_path: Path) -> None:
    """A file is refused if its includes multiply. Here each file includes the next file ten times,
    so the last file is included 10^30 times."""
    for k in range(30):
        (tmp_path / f"{k}.aff").write_text(f"i 0 {k + 1}.aff\n" * 10)
    (tmp_path / "30.aff").write_text(leaf)
    said = refusal(tmp_path / "0.aff", rt.LimitError)
    assert "with its includes" in said and budget.VARIABLE in said


def test_the_budget_counts_repeated_files_only(tmp_path: Path, monkeypatch) -> None:
    """The budget limits the copies that repeated includes make, and not the triangles and
    materials that a file lists itself."""
    monkeypatch.setenv(budget.VARIABLE, "0.1")
    own = "".join(f"fm {'0.5 ' * 12}\n{TRIANGLE}" for _ in range(1500))
    (tmp_path / "a.aff").write_text(own)
    assert len(rt.load_scene(tmp_path / "a.aff")) == 1500
    for included, times in ((own, 2),
                            (f"m vertices 2000 {'1 2 3 ' * 2000} triangles 1 0 1 2", 9)):
        (tmp_path / "c.aff").write_text(included)
        (tmp_path / "b.aff").write_text("i 0 c.aff\n" * times)
        assert re.search("with its includes: declares .* of data", refusal(
            tmp_path / "b.aff", rt.LimitError))
    (tmp_path / "c.aff").write_text(f"m vertices 3 {'1 2 3 ' * 3} triangles 900 {'0 1 2 ' * 900}")
    (tmp_path / "b.aff").write_text("i 0 c.aff\n" * 2)
    assert "1,800 triangles in all" in refusal(tmp_path / "b.aff", rt.LimitError)


def test_a_hundred_thousand_spheres_are_refused_before_they_are_made(tmp_path: Path) -> None:
    (tmp_path / "a.aff").write_text("s 0 0 0 1\n" * 100_000)
    assert "raise the budget" in refusal(tmp_path / "a.aff", rt.LimitError)
