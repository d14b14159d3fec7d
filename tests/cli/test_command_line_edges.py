"""Edge cases of the command line, of reports and of the Python API. A mistake on the command line
gives a message of one line, never a traceback."""
from __future__ import annotations

import os
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.accuracy.error_targets import ALL
from gpgpu_rt.accuracy.known_rays import check_kinds
from gpgpu_rt.accuracy.tune import LATE
from gpgpu_rt.cli import tuning, unfinished
from gpgpu_rt.cli.main import MODULES, command_parser
from gpgpu_rt.figures.framework import provenance
from gpgpu_rt.inspect.data_uris import MOST_PIXELS, png_uri
from gpgpu_rt.inspect.heat import heat
from gpgpu_rt.methods.settings import load as load_settings
from gpgpu_rt.report import page, write_report
from gpgpu_rt.scene.camera import load_cameras
from gpgpu_rt.workers import machine

DEEP = "[" * 100_000


def said(capsys, *words: str) -> tuple[int, str, str]:
    """Return the exit status, the standard output and the standard error of ``gpgpu-rt WORDS``."""
    try:
        status = cli.main(list(words))
    except SystemExit as stopped:
        status = int(str(stopped.code))
    return status, *capsys.readouterr()


def test_without_words_the_help_is_printed(capsys) -> None:
    status, out, err = said(capsys)
    assert status == 0 and out.startswith("usage:") and "render" in out and not err


def test_the_version_names_the_commit_of_a_checkout(capsys, monkeypatch) -> None:
    for made, end in (("abc123", " (commit abc123)"), (None, "")):
        monkeypatch.setattr(sys.modules["gpgpu_rt.cli.main"], "commit", lambda made=made: made)
        assert said(capsys, "--version") == (0, f"gpgpu-rt {rt.__version__}{end}\n", "")


def number_options() -> list[tuple[str, str, type]]:
    """Return (command, option, int or float) for each option that takes a number."""
    parsers = {command: command_parser(command)._subparsers._group_actions[0].choices[command]
               for command in MODULES}
    return [(command, action.option_strings[-1], action.type)
            for command, parser in parsers.items() for action in parser._actions
            if action.type in (int, float)]


def test_options_with_whole_numbers_and_with_fractions_are_tested() -> None:
    assert {kind for _, _, kind in number_options()} == {int, float}


@pytest.mark.parametrize("command, option", [words[:2] for words in number_options()])
def test_a_word_in_place_of_a_number_is_explained(command: str, option: str, capsys) -> None:
    status, out, err = said(capsys, command, option, "x")
    assert status == 2 and not out and err.count("\n") == 1
    assert "invalid" not in err
    assert re.search("'x' is not a .*; give a number such as ", err)


@pytest.mark.parametrize("words, advice", [
    (["rendr"], "did you mean render?"),
    (["heat", "cornell", "-m", "grid", "--what", "stps", "-o", "x.png"], "did you mean steps?"),
    (["render", "cornell", "--first-hits", "rasterized", "-o", "x.png"], "rasterised"),
    (["render", "cornel", "-o", "x.png"], "did you mean cornell"),
    (["render", "cornell", "--octant-s", "-o", "x.png"], "did you mean --octants"),
    (["render", "cornell", "-m", "grid", "--octants", "-o", "x.png"], "bvh-threaded, bvh-packet"),
    (["bench", "cornell", "-m", "grid", "--rays", "rndom"], "did you mean random?"),
    (["bench", "cornell", "--csv"], "give --table FILE.csv"),
    (["accuracy", "cornell", "--rays", "shadow"], "'shadow' is not a whole number of 1 or more"),
    (["accuracy", "cornell", "--rays", "0"], "'0' is not a whole number of 1 or more")],
    ids=lambda value: value[0] if isinstance(value, list) else "")
def test_a_misspelt_word_gets_a_suggestion(words: list[str], advice: str, capsys) -> None:
    status, out, err = said(capsys, *words)
    assert status and advice in err and err.count("\n") == 1 and not out


@pytest.mark.parametrize("words, advice", [
    ("accuracy cornell bunny", "accuracy takes one scene; run gpgpu-rt accuracy again for bunny"),
    ("trace cornell rays.npz more.npz -o hits.npz", "trace takes one scene and one RAYS.npz; run"),
    ("bench cornell -m grid bunny", "bench needs every scene before the first option; move bunny"),
    ("scenes bunny", "scenes takes no arguments; leave bunny out"),
    *((f"{words} kd-stack", f"takes a list with commas; give {words.split(' ', at)[-1]},kd-stack")
      for words, at in (("heat tenk -o x.png -m kd-restart", 4), ("bench cornell -m grid,bih", 2),
                        ("hardware --predict grid", 1))),
    ("heat tenk kd-stack -m grid -o x.png", "heat takes one scene; run gpgpu-rt heat again for"),
    ("heat tenk -m grid -o x.png kd-stack", "heat takes one scene; run gpgpu-rt heat again for"),
    ("hardware --card nv40 grid", "hardware takes no arguments; leave grid out"),
    ("hardware --predict all grid", "hardware takes no arguments; leave grid out")])
def test_an_argument_too_many_is_one_line(words: str, advice: str, capsys) -> None:
    status, out, err = said(capsys, *words.split())
    assert status == 2 and advice in err and err.count("\n") == 1 and not out


@pytest.mark.parametrize("words, redirection", [
    ("-m gpgpu_rt methods", ">&-"), ("-m gpgpu_rt methods", "| true"),
    ("-m gpgpu_rt render cornell --size 4 -o picture.png", "<&- >&- 2>&-"),
    ("-m gpgpu_rt.figures --help", ">&- 2>&-")])
def test_a_closed_stdout_is_no_mistake(words: str, redirection: str, tmp_path) -> None:
    done = subprocess.run(f"'{sys.executable}' {words} {redirection}", shell=True, cwd=tmp_path,
                          stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0 and "Error" not in done.stderr
    if "render" in words:
        with Image.open(tmp_path / "picture.png") as image:
            assert image.size == (4, 4)


@pytest.mark.parametrize("notes, closest, message", [
    ([LATE], None, "time ran out.*--budget"), ([], None, "give other methods"),
    ([LATE], SimpleNamespace(candidate="grid", note="slow"), "more time with --budget"),
    ([], SimpleNamespace(candidate="grid", note="slow"), "grid: slow; relax the bounds")])
def test_tune_says_why_no_candidate_fits(notes: list[str], closest: object, message: str) -> None:
    said = tuning._unreachable(SimpleNamespace(notes=notes, closest=closest, rays_of=ALL))
    assert re.search(message, said) and ("--budget" in said) == bool(notes)


# Nested too deep ------------------------------------------------------------------------------

@pytest.mark.parametrize("text", [DEEP, '{"a":' * 100_000, '{"settings":' + DEEP])
def test_json_that_is_nested_deep_is_refused(text: str, tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "deep.json"
    path.write_text(text)
    for read, kind in ((load_settings, rt.SettingsError), (load_cameras, rt.SceneError),
                       (rt.load_scene, rt.SceneError)):
        with pytest.raises(kind, match="deep.json.*nested too deep"):
            read(str(path))
    (tmp_path / "page.md").write_text("# page")
    for name in ("page", "parts"):
        path.with_name(f"{name}.json").write_text(text)
    assert provenance.held("page", tmp_path) is None
    folder = tmp_path / "film.png.unfinished"
    folder.mkdir()
    (folder / unfinished.RECORD).write_text(text)
    kept = unfinished.Unfinished(tmp_path / "film.png", 3, {}, resume=True)
    assert kept.missing == [0, 1, 2]
    kept._lock.release()


# The report -----------------------------------------------------------------------------------

def png_of(width: int, height: int) -> bytes:
    """Returns a PNG of one colour, which is a small file at any image size."""
    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(
            ">I", zlib.crc32(name + data))
    rows = zlib.compress(bytes((width + 7) // 8 + 1) * height, 9)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 1, 0, 0,
                                                              0, 0))
            + chunk(b"IDAT", rows) + chunk(b"IEND", b""))


@pytest.mark.parametrize("side", [30_000, 10_000, 6_000])
def test_a_huge_picture_is_left_out_of_the_report(side: int, tmp_path: Path) -> None:
    pytest.importorskip("markdown_it")
    assert side * side > MOST_PIXELS
    (tmp_path / "fig12.md").write_text("# Figure\n")
    (tmp_path / "fig12.png").write_bytes(png_of(side, side))
    with pytest.raises(ValueError, match="pixels"):
        png_uri(tmp_path / "fig12.png", 100)
    write_report(tmp_path / "r.html", tmp_path, films=False)
    assert "The picture fig12.png is missing" in (tmp_path / "r.html").read_text()


def test_the_report_takes_pictures_from_its_folder_alone(tmp_path: Path) -> None:
    pytest.importorskip("markdown_it")
    out = tmp_path / "out"
    (out / "more").mkdir(parents=True)
    Image.new("RGB", (3, 3)).save(tmp_path / "secret.png")
    for name in ("own.png", "more/own.png", "a b.png"):
        Image.new("RGB", (3, 3)).save(out / name)
    os.symlink(tmp_path / "secret.png", out / "link.png")
    os.mkfifo(out / "pipe.png")
    foreign = (f"{tmp_path}/secret.png", "../secret.png", "more/../../secret.png", "link.png",
               "pipe.png", "a%00b.png")
    own = ("own.png", "more/own.png", "more/../own.png", "a%20b.png")
    (out / "fig12.md").write_text("# F\n" + "".join(f"![{n}]({n})\n" for n in (*foreign, *own)))
    write_report(tmp_path / "r.html", out, films=False)
    text = (tmp_path / "r.html").read_text()
    assert text.count("data:image/png") == len(own)
    assert text.count(" is missing.<") == len(foreign) + 1  # fig12.png is missing too


def test_a_figures_name_is_escaped(tmp_path: Path) -> None:
    pytest.importorskip("markdown_it")
    name = 'x"><img src=x onerror=alert(1)>'
    (tmp_path / f"{name}.md").write_text("# F\n")
    write_report(tmp_path / "r.html", tmp_path, films=False)
    text = (tmp_path / "r.html").read_text()
    assert "<img src=x" not in text and 'id="x&quot;&gt;&lt;img' in text


def test_a_report_without_figures_says_how_to_name_them(tmp_path: Path, capsys) -> None:
    pytest.importorskip("markdown_it")
    status, out, _ = said(capsys, "report", "-o", str(tmp_path / "r.html"), "--still",
                          "--figures", str(tmp_path))
    assert status == 0 and "--figures" in out and len(out.splitlines()) == 2


def test_a_report_names_what_it_draws_in_words(tmp_path: Path, monkeypatch) -> None:
    """A report's progress messages are plain words, without the brackets and quotes of a tuple."""
    pytest.importorskip("markdown_it")

    def drawn(*_: object) -> str:
        return "drawn"
    for name in ("film", "heat_maps"):
        monkeypatch.setattr(page, name, drawn)
    told: list[str] = []
    write_report(tmp_path / "r.html", tmp_path, "cornell", (8, 8), say=told.append)
    assert told and not any(sign in line for line in told for sign in "()'")


# Values of a wrong type, through the Python API ------------------------------------------------

@pytest.mark.parametrize("wrong", [5, 1.5, True, b"egl", object(), [], {}, ("a",), {"a"}],
                         ids=lambda value: type(value).__name__)
def test_a_value_of_another_type_is_an_option_error(wrong: object) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, statistics=True) as tracer:
        for call in (lambda: rt.Tracer(scene, context=wrong), lambda: rt.Tracer(scene, wrong),
                     lambda: rt.Tracer(scene, schedule=wrong),
                     lambda: tracer.render(size=(4, 4), integrator=wrong),
                     lambda: heat(tracer, wrong, (4, 4)), lambda: check_kinds(wrong)):
            with pytest.raises(rt.OptionError):
                call()


def test_a_number_beyond_floats_is_an_option_error() -> None:
    with pytest.raises(rt.OptionError, match="density"):
        rt.Tracer("cornell", "grid", density=10**400)


def test_a_folder_in_place_of_the_lock_file_is_an_error(tmp_path: Path, monkeypatch) -> None:
    """A folder in place of the machine's lock file gives an error that says what to remove."""
    monkeypatch.setattr(machine, "_file", lambda: tmp_path)
    with pytest.raises(rt.Error, match="cannot lock.*remove what is there"), machine.taken():
        pass
