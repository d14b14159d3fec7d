"""CITATION.cff and the paper agree with the package: version, licence, authors and cited works."""
from __future__ import annotations

import configparser
import datetime
import re
from pathlib import Path
from typing import Any

import pytest
from snippets import ROOT

import gpgpu_rt as rt

yaml = pytest.importorskip("yaml")      # installed only because Dask needs this library

PAPER = (ROOT / "paper.md").read_text(encoding="utf-8")
HEAD = yaml.safe_load(PAPER.split("---\n")[1])
COUNT = len(rt.methods())
AUTHORS = "The gpgpu_rt authors"


def cff() -> dict[str, Any]:
    return yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def setup() -> configparser.SectionProxy:
    parser = configparser.ConfigParser()
    parser.read(ROOT / "setup.cfg")
    return parser["metadata"]


def keys(path: Path) -> list[str]:
    return re.findall(r"(?m)^@\w+\{([^,\s]+),", path.read_text(encoding="utf-8"))


def test_the_citation_file_has_what_version_1_2_needs() -> None:
    held = cff()
    assert held["cff-version"] == "1.2.0" and held["type"] == "software"
    assert all(held[field] for field in ("message", "title", "authors", "abstract"))


def test_the_citation_file_is_valid() -> None:
    cffconvert = pytest.importorskip("cffconvert")
    cffconvert.Citation((ROOT / "CITATION.cff").read_text()).validate()


def test_version_licence_and_authors_are_those_of_the_package() -> None:
    held = cff()
    assert held["version"] == rt.__version__ and held["license"] == setup()["license"]
    assert [author["name"] for author in held["authors"]] == [AUTHORS]
    assert AUTHORS in (ROOT / "LICENSE").read_text()
    assert [author["name"] for author in HEAD["authors"]] == [AUTHORS]


def test_the_date_is_that_of_the_paper() -> None:
    written = datetime.datetime.strptime(str(HEAD["date"]), "%d %B %Y").date()
    assert cff()["date-released"] == written


def test_the_bibtex_entry_agrees_with_the_citation_file() -> None:
    """The documentation has the only BibTeX entry of this project."""
    held, entry = cff(), ROOT / "docs" / "index.md"
    fields = {name: value.replace("\\_", "_") for name, value in re.findall(
        r"(?m)^  (\w+) += \{*(.+?)\}*,?$", entry.read_text(encoding="utf-8"))}
    date = held["date-released"]
    assert keys(entry) == ["gpgpu_rt"]
    assert fields == {"author": AUTHORS, "title": held["title"], "year": f"{date:%Y}",
                      "month": f"{date:%b}".lower(), "note": f"Version {held['version']}"}


def test_each_cited_work_has_one_entry() -> None:
    entries = [key for name in HEAD["bibliography"] for key in keys(ROOT / name)]
    assert len(entries) == len(set(entries))
    body = PAPER.split("---\n", 2)[2]
    cited = set(re.findall(r"@([a-z]+\d*)", body))
    assert cited <= set(entries)
    assert set(keys(ROOT / "paper.bib")) <= cited       # every entry is cited


def test_the_paper_has_the_parts_of_a_software_paper() -> None:
    body = PAPER.split("---\n", 2)[2]
    heads = re.findall(r"(?m)^# (.+)$", body)
    assert {"Summary", "Statement of need", "State of the field", "Limits", "References"} <= set(
        heads)
    assert 250 <= len(body.split()) <= 1000


def test_the_papers_numbers_are_those_of_the_pages() -> None:
    conformance = (ROOT / "docs" / "conformance.md").read_text(encoding="utf-8")
    assert f"| this project, {COUNT} methods | 13,003 each | 758 | 0 |" in conformance
    assert f"runs {COUNT} of them" in PAPER and f"the {COUNT} methods" in PAPER
    wrong = [int(row.split("|")[4].replace(",", "")) for row in conformance.splitlines()
             if row.startswith("| ") and row.count("|") == 10 and row.split("|")[4].strip(
                 " ,0123456789") == ""]
    assert len(wrong) == 11 and f"{sorted(wrong)[1]} to {max(wrong)} wrong answers" in PAPER
    kd_trees = " ".join((ROOT / "docs" / "kd-trees.md").read_text(encoding="utf-8").split())
    assert "at most 2.7 % more nodes than `kd-stack`" in kd_trees
    race = (ROOT / "docs" / "notes" / "race.md").read_text(encoding="utf-8")
    assert "| eye | 4.34 (2.42) | 8.32 (4.49) | 6.66 (4.02) | 4.28 (2.93) |" in race
    assert "| eye | 0.58 (0.33) | 1.08 (0.58) | 0.89 (0.54) | 0.67 (0.47) |" in race
