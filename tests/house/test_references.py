"""Each citation of the project names a work of the list of references, and the project cites each
work of the list. Each cited section of the survey exists."""
from __future__ import annotations

import csv
import functools
import json
import re
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.cli.program import files_of_method
from gpgpu_rt.methods.references import SECTIONS, citations, cited, find_work, reference, works

ROOT = Path(rt.__file__).parents[1]
FOLDERS = ("gpgpu_rt", "glsl", "figures", "docs", "examples", "README.md", "CONTRIBUTING.md")
TEXTS = (".py", ".md", ".glsl", ".frag", ".vert", ".csv", ".json")
MADE = ("figures/data", "figures/out")     # made by `make figures`
NOT_WORKS = {"ComputerBase 2006",    # a magazine's review of a card
             "Ultra 2004"}           # a card and its year, in a table
# Works that were once cited with a wrong section -> the section that discusses the work.
DISCUSSED = {"Arvo and Kirk 1987": "5", "Mortensen et al. 2007": "5",
             "Waechter and Keller 2006": "4.4", "Lauterbach et al. 2009": "5",
             "Wald, Gribble, Boulos and Kensler 2007": "4.3", "Roger et al. 2007": "3.6"}
# A citation of sections of the survey: "survey, section 3.4", "the survey's sections 4.3 and 5",
# "the survey (section 5) ...", and without the word "section": "survey, 3.6.2".
OF_SURVEY = re.compile(
    r"survey(?:'s)?(?: proposes[^.]{0,40}?)?(?:,| |\(|its)*(?:sections? )?(?<![\w.])"
    r"(\d(?:\.\d+)*(?:(?:, | and |, and )\d(?:\.\d+)*)*)(?![\w])")


@functools.cache
def texts() -> dict[str, str]:
    """Returns file name -> text. A comment or a string that fills several lines is joined into one
    line."""
    paths = [path for folder in FOLDERS
             for path in ([ROOT / folder] if "." in folder else (ROOT / folder).rglob("*"))]
    names = [str(path.relative_to(ROOT)) for path in paths if path.suffix in TEXTS]
    return {name: _in_one_line(name, (ROOT / name).read_text(encoding="utf-8"))
            for name in names if not name.startswith(MADE)}


def _in_one_line(name: str, text: str) -> str:
    if name.endswith((".glsl", ".frag", ".vert")):
        text = re.sub(r"\s*\n\s*//+ ?", " ", text)
    if name.endswith(".py"):
        text = re.sub(r'"\s*\n\s*f?"', "", text)      # adjacent strings
        text = re.sub(r"\s*\n\s*# ?", " ", text)
    return re.sub(r"\s+", " ", text)


def test_every_citation_names_a_work() -> None:
    unknown = {(name, words) for name, text in texts().items()
               for words, work in citations(text) if work is None and words not in NOT_WORKS}
    assert not unknown


def test_every_work_is_cited() -> None:
    found = {work.key for text in texts().values() for work in cited(text)}
    assert "*Ray Tracing on Graphics Hardware*" in texts()["README.md"]
    assert set(works()) - found == {"survey"}


# Methods from a user's folder are left out: they may cite works that are not in the list. The
# paths of their files are absolute.
OWN = [row for row in rt.methods() if not Path(row.glsl).is_absolute()]


@pytest.mark.parametrize("row", OWN, ids=lambda row: row.name)
def test_every_method_s_paper_is_one_work_of_the_survey(row: rt.Method) -> None:
    """A method's citation names one work. Each section that the list of references gives for the
    work exists in the survey. If a GLSL file of the method cites a section after this work and
    before any other work, the list gives the section for this work."""
    work = find_work(row.citation)
    assert work is not None and work.sections and set(work.sections) <= set(SECTIONS)
    assert reference(row.citation).endswith(f"(survey, {work.discussed})")
    own = [name for name, _ in files_of_method(row.name) if name.startswith("glsl/methods/")]
    sections = {section for name in own for at, section in _sections(texts()[name])
                if [one.key for one in cited(texts()[name][:at])] == [work.key]}
    assert sections <= set(work.sections)


def test_every_published_number_has_a_source() -> None:
    for name in ("published", "table1"):
        with (ROOT / f"figures/published/{name}.csv").open(newline="", encoding="utf-8") as file:
            sources = {row["source"] for row in csv.DictReader(file)} - {"survey"}
        assert sources and all(find_work(source) for source in sources)


def _sections(text: str) -> list[tuple[int, str]]:
    """Returns (place in the text, section) for each section of the survey that a text cites."""
    return [(at.start(), section) for at in OF_SURVEY.finditer(text)
            for section in re.findall(r"\d(?:\.\d+)*", at[1])]


def test_cited_sections_exist() -> None:
    """The survey has every section that a text cites. Every number after the word "section" is
    also a section of the survey, even if the text means a section of a paper."""
    found = [(name, section) for name, text in texts().items()
             for section in [section for _, section in _sections(text)]
             + re.findall(r"[Ss]ections? (\d+(?:\.\d+)*)", text)]
    assert len(found) > 100
    assert {(name, section) for name, section in found if section not in SECTIONS} == set()
    assert {section for work in works().values() for section in work.sections} <= set(SECTIONS)


def test_a_work_s_section_is_that_of_the_survey() -> None:
    """Where a sentence cites a work and a section of the survey, the survey discusses the work in
    this section."""
    wrong = set()
    for name, text in texts().items():
        for at, section in _sections(text):
            before = re.split(r"(?<=[a-z0-9)])\. |; [A-Z]", text[max(0, at - 260):at])[-1]
            sections = {one for work in cited(before) for one in work.sections}
            if sections and section not in sections:
                wrong.add((name, section, before[-80:]))
    assert not wrong


@pytest.mark.parametrize("citation, section", DISCUSSED.items())
def test_sections_of_works(citation: str, section: str) -> None:
    work = find_work(citation)
    assert work is not None and section in work.sections


@pytest.mark.parametrize("words, key", [
    ("Foley and Sugerman 2005", "foley2005"), ("Horn et al. (2007)", "horn2007"),
    ("Horn 2005", "horn2005"), ("Szecsi 2006", "szecsi2006"), ("Szécsi 2006", "szecsi2006"),
    ("Moeller and Trumbore 1997", "moeller1997"), ("D. Horn's (2005)", "horn2005"),
    ("Roger et al. 2007b", "roger2007b"), ("Roger, Assarsson, Holzschuch 2007", "roger2007"),
    ("Wald, Boulos and Shirley 2007", "wald2007a"), ("Wald 2007", "wald2007"),
    ("Shah, \"Caustics Mapping\", TVCG 2007", "shah2007"),
    ("Wald et al. 2007", None),          # two works
    ("Foley 2005", None), ("Foley et al. 2005", None), ("Foley and Sugerman 2006", None),
    ("Horn, Sugerman and Hanrahan 2007", None), ("\"Faster Rays\", SIGGRAPH 2007", None)])
def test_citations_are_read_strictly(words: str, key: str | None) -> None:
    work = find_work(words)
    assert (work.key if work else None) == key


def test_budge_is_cited_as_the_survey_does() -> None:
    assert reference("Budge et al. 2008") == (
        "B. C. Budge, J. C. Anderson, C. Garth and K. I. Joy, \"A Hybrid CPU-GPU Implementation "
        "for Interactive Ray-Tracing of Dynamic Scenes\", technical report CSE-2008-9, University "
        "of California, Davis, Computer Science, 2008 (survey, section 3.4)")


def test_the_command_shows_the_full_citation(capsys: pytest.CaptureFixture) -> None:
    assert cli.main(["methods", "bih"]) in (0, None)
    assert f"reference: {reference('Waechter and Keller 2006')}\n" in capsys.readouterr().out
    assert cli.main(["methods", "bih", "--json"]) in (0, None)
    row, = json.loads(capsys.readouterr().out)
    assert row["reference"] == reference(row["citation"])


def test_a_method_of_an_unknown_work_keeps_its_citation() -> None:
    assert reference("Nobody 2026") == "Nobody 2026"
