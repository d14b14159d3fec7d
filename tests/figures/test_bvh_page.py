"""The tables of docs/bvh.md, and two tables of docs/notes/bvh.md, show the numbers that these
tests measure."""
from __future__ import annotations

import argparse
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.scene import catalogue

PAGE = Path(__file__).parents[2] / "docs" / "bvh.md"
NOTE = PAGE.parent / "notes" / "bvh.md"
SCENES = ("cornell", "bunny", "robots", "kitchen", "conference")


def tables() -> dict[str, dict[str, dict[str, float]]]:
    """Returns the page's tables: counter -> method with options -> scene -> number."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    table: dict[str, dict[str, float]] | None = None
    for line in PAGE.read_text().splitlines():
        if not line.startswith("|"):
            table = None  # the table has ended
        name, *values = (cell.strip(" `") for cell in line.strip("|").split("|"))
        if values and values[0] == SCENES[0]:
            found[name] = table = {}
        elif table is not None and line.startswith("| `"):
            table[name] = dict(zip(SCENES, map(float, values)))
    return found


def asked(words: str) -> tuple[str, dict[str, object]]:
    """Returns the method and the options that a row names, such as bvh-packet --packet 4x2."""
    parser = argparse.ArgumentParser()
    parser.add_argument("method")
    parser.add_argument("--packet", type=lambda text: tuple(map(int, text.split("x"))))
    parser.add_argument("--quantise-nodes", type=int)
    for switch in ("--octants", "--interval-test", "--streams"):
        parser.add_argument(switch, action="store_true", default=None)
    given = vars(parser.parse_args(words.split()))
    return given.pop("method"), {name: value for name, value in given.items() if value is not None}


@pytest.mark.parametrize("scene, words", [
    pytest.param(scene, words, marks=() if scene == "cornell" else pytest.mark.full)
    for scene in SCENES for words in tables()["nodes"]])
def test_counters_are_as_the_page_says(scene: str, words: str) -> None:
    if catalogue.mesh_path(scene) is None:
        pytest.skip(f"the page is about the mesh of {scene}; name its folder in GPGPU_RT_SCENES")
    method, options = asked(words)
    with rt.Tracer(scene, method, statistics=True, **options) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        counters = tracer.statistics.counters
    for table, counter in (("nodes", "nodes_visited"), ("triangles", "triangles_tested")):
        assert counters[counter] == pytest.approx(tables()[table][words][scene], rel=0.006)


def test_the_page_has_every_bvh_method() -> None:
    family = {row.name for row in rt.methods() if row.name.startswith("bvh-")}
    assert family == {asked(words)[0] for words in tables()["nodes"]}
    assert all(f"**`{name}`**" in PAGE.read_text() for name in family)
    assert all(list(table) == list(tables()["nodes"]) for table in tables().values())


@pytest.mark.full
@pytest.mark.parametrize("size, row", [(4096, 0), (1 << 14, 1), (1 << 15, 2), (1 << 16, 3),
                                       (1 << 22, 4)])
def test_streams_are_as_the_note_says(size: int, row: int) -> None:
    """In the note, the table of stream sizes and the list of stream lengths by level show the
    measured numbers."""
    if catalogue.mesh_path("bunny") is None:
        pytest.skip("the note is about the mesh of bunny; name its folder in GPGPU_RT_SCENES")
    text = NOTE.read_text()
    lines = text[text.index("| elements a pass |"):].splitlines()[2:]
    with rt.Tracer("bunny", "bvh-packet", streams=True, stream_size=size,
                   statistics=True) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        statistics, lengths = tracer.statistics, tracer.session.driver.lengths
    nodes, triangles, streams, draws = map(float, lines[row].strip("|").split("|")[1:])
    assert statistics.counters["nodes_visited"] == pytest.approx(nodes, rel=0.006)
    assert statistics.counters["triangles_tested"] == pytest.approx(triangles, rel=0.006)
    assert (len(lengths), statistics.draw_calls) == (streams, draws)
    if size == 1 << 22:
        assert ", ".join(f"{length:,}" for length in lengths) in " ".join(text.split())


def test_note_and_page_agree_on_node_counts() -> None:
    """The note's table of streams and the page's table of nodes have the same node counts for eye
    rays."""
    text, nodes = NOTE.read_text(), tables()["nodes"]
    rows = text[text.index("| per ray |"):].split("\n\n")[0].splitlines()
    heads, *rows = [[cell.strip() for cell in row.strip("|").split("|")]
                    for row in rows if "---" not in row]
    words = {"a stack for each ray": "bvh-stack", "packets of 2x2": "bvh-packet",
             "packets of 4x2": "bvh-packet --packet 4x2", "streams": "bvh-packet --streams"}
    assert [row[0] for row in rows] == list(words)
    for name, *cells in rows:
        for head, cell in zip(heads[1:], cells):
            scene, kind = head.split(", ")
            if kind == "eye":
                assert float(cell.split(",")[0]) == nodes[words[name]][scene], (name, head)
