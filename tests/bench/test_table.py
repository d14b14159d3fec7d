"""`gpgpu-rt bench --table` writes races as a table in LaTeX or CSV."""
from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.bench import Entry
from gpgpu_rt.bench.table import COLUMNS, write
from gpgpu_rt.cli import benching

BOX = {"scene": "my_box", "triangles": 12, "stand_in": None}
BUNNY = {"scene": "bunny", "triangles": 9, "stand_in": "the Stanford bunny"}


def entry(name: str, over: list[float], **more: object) -> Entry:
    """Return an entry with five rounds of 1 to 5 seconds for ten million rays."""
    seconds = [3.0, 1.0, 5.0, 4.0, 2.0]
    return Entry(name, more.pop("options", {}), 10_000_000, seconds, seconds, over, over, **more)


COUNTED = entry("bvh-packet", [0.5, 0.25, 0.75], options={"packet": (4, 2), "quantise_nodes": 16},
                work={"nodes_visited": 2.25, "triangles_tested": 1.0})
RACES = [(BOX, "eye", [COUNTED, entry("an engine", [], out_of=20_000_000)]),
         (BUNNY, "shadow", [entry("grid", [])])]


def test_a_latex_table_has_rates_quartiles_and_work(tmp_path: Path) -> None:
    write(str(tmp_path / "t.tex"), RACES, ["gpgpu-rt bench my_box", "a processor"])
    assert (tmp_path / "t.tex").read_text().splitlines() == [
        "% gpgpu-rt bench my_box", "% a processor", r"\begin{tabular}{lllrrrrr}", r"\hline",
        r"scene & rays & method & Mrays/s & quartiles & over embreex & nodes visited & "
        r"triangles tested \\", r"\hline",
        r"my\_box & eye & bvh-packet packet=4x2 quantise\_nodes=16 & 3.33 & 2.5--5 & 0.5 & 2.25 & "
        r"1 \\",
        r"my\_box & eye & an engine, 10,000,000 of 20,000,000 rays & 3.33 & 2.5--5 & - & - & - \\",
        r"bunny (stand-in) & shadow & grid & 3.33 & 2.5--5 & - & - & - \\",
        r"\hline", r"\end{tabular}"]


def test_columns_without_numbers_are_left_out_of_latex(tmp_path: Path) -> None:
    write(str(tmp_path / "t.tex"), [(BOX, "eye", [entry("grid", [])])], [])
    heads = (tmp_path / "t.tex").read_text().splitlines()[2]
    assert heads == r"scene & rays & method & Mrays/s & quartiles \\"


def test_a_csv_file_has_all_numbers(tmp_path: Path) -> None:
    write(str(tmp_path / "t.csv"), RACES, ["not in the file"])
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(COLUMNS) and len(rows) == 3
    told = COUNTED.to_dict()
    for name in COLUMNS:
        if name in told and name not in ("rays", "name", "options"):
            assert rows[0][name] == str(told[name] if told[name] is not None else ""), name
    assert (rows[0]["rays"], rows[0]["count"]) == ("eye", "10000000")
    assert rows[0]["options"] == "packet=4x2 quantise_nodes=16"
    assert rows[0]["nodes_visited"] == "2.25"
    assert (rows[1]["nodes_visited"], rows[1]["over_embree"], rows[0]["stand_in"]) == ("", "", "")
    assert [row["out_of"] for row in rows] == ["", "20000000", ""]
    assert rows[2]["stand_in"] == "the Stanford bunny" and rows[2]["triangles"] == "9"


def test_any_name_and_any_rate_gives_latex_that_compiles(tmp_path: Path) -> None:
    strange = {**BOX, "scene": "a\\b~c^d_e%f{g}$h#i&j\udcff"}
    slow = Entry("grid", {}, 1, [4e6], [4e6], [], [])
    fast = Entry("grid", {}, 10**12, [1e-3], [1e-3], [], [])
    write(str(tmp_path / "t.tex"), [(strange, "eye", [slow, fast])], ["bench a\nb \udcff.obj"])
    lines = (tmp_path / "t.tex").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "% bench a b ?.obj" and lines[1].startswith(r"\begin{tabular}")
    name = (r"a\textbackslash{}b\textasciitilde{}c\textasciicircum{}d\_e\%f\{g\}\$h\#i\&j?")
    assert lines[5:7] == [rf"{name} & eye & grid & 2.5e-13 & 2.5e-13--2.5e-13 \\",
                          rf"{name} & eye & grid & 1e+09 & 1e+09--1e+09 \\"]


def test_a_table_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(AttributeError):
        write(str(tmp_path / "t.csv"), [(BOX, "eye", [None])], [])      # type: ignore[list-item]
    assert not list(tmp_path.iterdir())


def test_the_command_writes_the_races_that_it_prints(tmp_path: Path, capsys) -> None:
    table = tmp_path / "t.tex"
    assert cli.main(["bench", "cornell", "tenk", "--rays", "eye,shadow", "--size", "8",
                     "--runs", "1", "--engine", "none", "-m", "grid", "--statistics",
                     "--json", "--table", str(table)]) == 0
    races = json.loads(capsys.readouterr().out)["races"]
    lines = table.read_text().splitlines()
    assert [line[0] for line in lines[:4]] == ["%"] * 4 and "--table" in lines[0]
    assert [line.split(" & ")[:3] for line in lines if line.endswith(r" \\")][1:] == [
        [race["scene"] + " (stand-in)" * bool(race["stand_in"]), race["rays"], "grid"]
        for race in races]


def test_the_file_is_written_before_the_notes(tmp_path: Path, capsys, monkeypatch) -> None:
    """Printing the notes may stop the command, for example if the reader of a pipe has gone."""
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt
    monkeypatch.setattr(benching, "_print_notes", stopped)
    assert cli.main(["bench", "cornell", "--size", "8", "--runs", "1", "--engine", "none", "-m",
                     "grid", "--table", str(tmp_path / "t.csv")]) == 130
    assert (tmp_path / "t.csv").read_text().count("\n") == 2


def test_a_file_that_cannot_be_written_loses_no_race(tmp_path: Path, capsys, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise rt.Error("the disk is full")
    monkeypatch.setattr(benching.table, "write", full)
    assert cli.main(["bench", "cornell", "--size", "8", "--runs", "1", "--engine", "none", "-m",
                     "grid", "--json", "--table", str(tmp_path / "t.csv")]) == 1
    out, err = capsys.readouterr()
    assert len(json.loads(out)["races"]) == 1 and "the disk is full" in err


def test_a_method_has_options_of_its_own(capsys) -> None:
    assert cli.main(["bench", "cornell", "--size", "8", "--runs", "1", "--engine", "none",
                     "--json", "--octants", "-m", "bvh-packet build=kay-kajiya packet=4x2",
                     "-m", "bvh-threaded,bvh-packet interval-test"]) == 0
    entries = json.loads(capsys.readouterr().out)["races"][0]["entries"]
    assert [(one["name"], one["options"]) for one in entries] == [
        ("bvh-packet", {"octants": True, "build": "kay-kajiya", "packet": [4, 2]}),
        ("bvh-threaded", {"octants": True}),
        ("bvh-packet", {"octants": True, "interval_test": True})]


def test_an_option_of_its_own_goes_before_the_option_of_all(capsys) -> None:
    assert cli.main(["bench", "cornell", "--size", "8", "--runs", "1", "--engine", "none",
                     "--json", "--packet", "4x2", "-m", "bvh-packet --packet=2x1",
                     "-m", "bvh-packet"]) == 0
    entries = json.loads(capsys.readouterr().out)["races"][0]["entries"]
    assert [one["options"] for one in entries] == [{"packet": [2, 1]}, {"packet": [4, 2]}]


def test_the_help_of_a_method_with_options(capsys) -> None:
    with pytest.raises(SystemExit):
        cli.main(["bench", "-m", "bvh-packet octants", "--help"])
    assert "--octants" in capsys.readouterr().out


@pytest.mark.parametrize("words, message", [
    (["--table", "t.xls"], "--table t.xls: end the file's name in .tex or .csv"),
    (["--table", "no/such/t.tex"], "there is no folder"),
    (["-m", "bvh-packet octant"], "-m 'bvh-packet octant': method bvh-packet has no option "
     "'octant'; did you mean octants?"),
    (["-m", "bvh-packet packet=5x5"], "option packet='5x5' is none of"),
    (["-m", "bvh-packet reinsertion"], "give reinsertion=VALUE"),
    (["-m", "grid statistics"], "all methods share --statistics; give it apart"),
    (["-m", "grid context=osmesa"], "all methods share --context"),
    (["-m", "bvh-packet era=g81"], "'g81'"),
    (["-m", "bvh-packed octants"], "did you mean bvh-packet")])
def test_a_mistake_is_one_line(capsys, words: list[str], message: str) -> None:
    assert cli.main(["bench", "cornell", "--size", "8", "-m", "grid", *words]) == 1
    error, = capsys.readouterr().err.splitlines()
    assert message in error
