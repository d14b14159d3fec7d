"""References: the works that the project cites, from ``figures/published/references.bib``.

A text cites a work by authors and year, as in "Foley and Sugerman 2005" and "Horn et al. (2007)",
or by its title in quotation marks with the year after it.
"""
from __future__ import annotations

import functools
import importlib.resources
import re
import unicodedata
from dataclasses import dataclass

# The headings of the survey, "Ray Tracing on Graphics Hardware": number -> title.
SECTIONS = {
    "1": "Introduction", "2": "Overview", "2.1": "Ray Tracing",
    "2.2": "Programmable Graphics Hardware", "3": "Ray Tracing on Graphics Hardware",
    "3.1": "CPU/GPU Hybrid Ray Tracing", "3.2": "GPU Ray Tracing", "3.3": "Uniform Grids",
    "3.4": "kD-tree", "3.5": "Bounding Volume Hierarchy", "3.6": "Ray-Space Hierarchy",
    "4": "Discussion", "4.1": "Absolute Performance", "4.2": "Comparison with CPU Ray Tracing",
    "4.3": "Performance Gap", "4.4": "Other Related Work", "5": "Future Work", "6": "Conclusion"}

_FIELD = re.compile(r"(\w+) = \{((?:[^{}]|\{[^{}]*\})*)\}")
_ENTRY = re.compile(r"@(\w+)\{(\w+),")
_NAME = r"(?:[A-Z]\. ?(?:-?[A-Z]\. ?)*)?[^\W\d_a-z](?:[^\W\d_]|-)*[^\W\d_A-Z](?:['’]s)?"
_AND = r"(?:, and | and |, )"
# Such as "Foley and Sugerman 2005"; a letter may follow the year.
_BY_AUTHORS = re.compile(
    rf"({_NAME}(?:{_AND}{_NAME})*?(?: et al\.)?),? \(?((?:18|19|20)\d\d[a-z]?)\b")
_BY_TITLE = re.compile(r"""["“]([A-Z][^"“”]{9,160}?)[,.]?["”],? [^"“”]{0,60}?"""
                       r"((?:18|19|20)\d\d)\b")


@dataclass(frozen=True)
class CitedWork:
    """A work that the project cites.

    Attributes
    ----------
    key : the work's name in the file, such as "arvo1987"; a letter may follow the year
    authors : initials and surname of each author
    venue : journal, conference or school, with the volume
    year : None if the work has no year
    sections : numbers of the survey's sections that discuss the work
    """

    key: str
    authors: tuple[str, ...]
    title: str
    venue: str
    year: int | None
    sections: tuple[str, ...]

    def __str__(self) -> str:
        *first, last = self.authors
        names = f"{', '.join(first)} and {last}" if first else last
        where = ", ".join(part for part in (self.venue, str(self.year or "")) if part)
        return f"{names}, \"{self.title}\", {where}"

    @property
    def surnames(self) -> tuple[str, ...]:
        return tuple(name.split(" ")[-1] for name in self.authors)

    @property
    def discussed(self) -> str:
        """Where the survey discusses the work, such as "section 3.4"; empty if nowhere."""
        return "" if not self.sections else (
            f"section{'s' * (len(self.sections) > 1)} {', '.join(self.sections)}")

    def written_by(self, names: list[str], more: bool) -> bool:
        """Whether a citation with these surnames means this work; ``more``: with "et al."."""
        if len(names) + more > len(self.surnames) or more and len(self.surnames) < 3:
            return False
        return (more or len(names) == len(self.surnames)) and all(
            _spellings(one) & _spellings(other) for one, other in zip(names, self.surnames))


@functools.cache
def works() -> dict[str, CitedWork]:
    """Return all works by key, in the file's order."""
    file = importlib.resources.files("gpgpu_rt.figures") / "published" / "references.bib"
    return {work.key: work for work in map(_work, re.split(
        r"^(?=@)", file.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:])}


def find_work(citation: str) -> CitedWork | None:
    """Return the only work that fits a citation such as "Horn et al. 2007", or None."""
    found = [work for _, work in citations(citation)]
    return found[0] if len(found) == 1 else None


def reference(citation: str) -> str:
    """Return the full citation and the survey's sections; an unknown citation unchanged."""
    work = find_work(citation)
    if work is None:
        return citation
    return f"{work}" + (f" (survey, {work.discussed})" if work.sections else "")


def citations(text: str) -> list[tuple[str, CitedWork | None]]:
    """Return (words, work) for each citation in a text. The work is None if it is unknown.

    Any capitalised name before a year, such as a conference's name, counts as a citation.
    """
    text = re.sub(r"\s+", " ", text)
    found = [(at.start(), at[0], _titled(at[1])) for at in _BY_TITLE.finditer(text)]
    titles = [(at.start(), at.end()) for at in _BY_TITLE.finditer(text)]
    for at in _BY_AUTHORS.finditer(text):
        if not any(start <= at.start() < end for start, end in titles):
            found.append((at.start(), at[0], _authored(at[1], at[2])))
    return [(words, work) for _, words, work in sorted(found, key=lambda one: one[0])]


def cited(text: str) -> list[CitedWork]:
    """Return the works that a text cites, each once, sorted by first author and then by key."""
    found = {work.key: work for _, work in citations(text) if work is not None}
    return sorted(found.values(), key=lambda work: (_plain(work.surnames[0]), work.key))


def _titled(title: str) -> CitedWork | None:
    """Return the work whose title is, or begins with, ``title``."""
    asked = _plain(title)
    return next((work for work in works().values() if _plain(work.title).startswith(asked)), None)


def _authored(names: str, year: str) -> CitedWork | None:
    """Return the only work of these authors and this year, or None. For a year without a letter,
    a key without a letter is preferred."""
    more = names.endswith(" et al.")
    surnames = [re.sub(r"['’]s$", "", name).split(" ")[-1].split(".")[-1]
                for name in re.split(_AND, names.removesuffix(" et al."))]
    found = [work for work in works().values()
             if str(work.year) == year[:4] and work.written_by(surnames, more)]
    lettered = [work for work in found if work.key.endswith(year)]
    chosen = lettered if lettered else found if year[4:] == "" else []
    return chosen[0] if len(chosen) == 1 else None


def _work(entry: str) -> CitedWork:
    head = _ENTRY.match(entry)
    assert head is not None, entry
    fields = {name: re.sub(r"\s+", " ", value).replace("{", "").replace("}", "")
              for name, value in _FIELD.findall(entry)}
    return CitedWork(head[2], tuple(fields["author"].split(" and ")), fields["title"],
                     _venue(head[1], fields), int(fields["year"]) if "year" in fields else None,
                     tuple(re.findall(r"[\d.]+", fields.get("survey", ""))))


def _venue(kind: str, fields: dict[str, str]) -> str:
    if kind == "article":
        number = f"({fields['number']})" if "number" in fields else ""
        volume = f" {fields['volume']}{number}" if "volume" in fields else ""
        return fields["journal"] + volume
    degree = {"mastersthesis": "master's thesis", "phdthesis": "PhD thesis",
              "techreport": f"technical report {fields.get('number', '')}".strip()}.get(kind)
    place = [fields[name] for name in ("booktitle", "school", "institution", "publisher",
                                       "howpublished") if name in fields]
    return ", ".join([degree, *place] if degree else place)


def _plain(text: str) -> str:
    """Return the letters and digits of a text, without accents and in lower case."""
    bare = unicodedata.normalize("NFKD", text)
    return "".join(c for c in bare if c.isalnum() and not unicodedata.combining(c)).lower()


def _spellings(name: str) -> set[str]:
    """Return the spellings of a surname without accents: Moller and Moeller for Möller."""
    return {_plain(name), _plain(name.translate(str.maketrans(
        {"ä": "ae", "ö": "oe", "ü": "ue"})))}
