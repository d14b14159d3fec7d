"""Copies the project's pages to a folder, in the form from which Sphinx makes the site."""
from __future__ import annotations

import re
import shutil
from pathlib import Path

from .generated import PAGES, generate
from .links import DOCS, MOVED, ROOT, with_links

CHAPTERS = ("tour", "how-to")       # folders of docs/ whose pages are listed in order of name
_MARK = re.compile(r"^<!-- generated: (\w+) -->$", re.M)
_ITEM = re.compile(r"^[-*] \[[^\]]*\]\(([^)#]+)\.md\)", re.M)


def stage(folder: Path) -> None:
    """Copies all pages and pictures of docs/, README and CONTRIBUTING to a new folder.

    README and docs/index.md become the site's first page. The generated text NAME replaces a
    comment ``<!-- generated: NAME -->``.
    """
    def keep(target: Path) -> str:
        place = folder / "files" / target.relative_to(ROOT)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(target, place)
        return str(place.relative_to(folder))

    def write(page: Path, name: str, text: str) -> None:
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(with_links(text, page, name, keep), encoding="utf-8")

    shutil.copytree(DOCS, folder, ignore=shutil.ignore_patterns("*.md"))
    for page in sorted(DOCS.rglob("*.md")):
        name = str(page.relative_to(DOCS))
        text = _MARK.sub(lambda mark: PAGES[mark[1]](), page.read_text(encoding="utf-8"))
        write(page, name, text + _chapters(page))
    for page, name in MOVED.items():
        write(page, name, page.read_text(encoding="utf-8"))
    for name, text in generate():
        write(DOCS / name, name, text)
    readme, index = (folder / "index.md").read_text(encoding="utf-8"), DOCS / "index.md"
    write(index, "index.md", index.read_text(encoding="utf-8"))
    map_of_pages = (folder / "index.md").read_text(encoding="utf-8").partition("\n")[2]
    (folder / "index.md").write_text(readme + map_of_pages + _sidebar(index), encoding="utf-8")


def _chapters(page: Path) -> str:
    """For a folder's first page, returns a list of the folder's other pages; else ""."""
    if page.parent == DOCS or page.name not in ("index.md", "README.md"):
        return ""
    names = sorted((one.stem for one in page.parent.glob("*.md") if one != page), key=_in_order)
    if page.parent.name == "reference":
        names = re.findall(r"\(([\w-]+)\.md\)", page.read_text(encoding="utf-8"))
    return _toctree("", list(dict.fromkeys(names)))


def _in_order(name: str) -> tuple[int, str]:
    """Returns a sort key that puts 2-boxes before 10-films."""
    number = re.match(r"\d+", name)
    return int(number[0]) if number else 0, name


def _sidebar(index: Path) -> str:
    """Returns the lists of the sidebar: one for each of CHAPTERS and each heading of index.md."""
    found = "".join(_toctree(title.capitalize(), [f"{title}/index"]) for title in CHAPTERS
                    if (DOCS / title / "index.md").exists())
    for section in index.read_text(encoding="utf-8").split("\n## ")[1:]:
        title, _, text = section.partition("\n")
        names = [str(Path(name).relative_to("..") if name.startswith("..") else name)
                 for name in _ITEM.findall(text)]
        names = ["contributing" if name == "CONTRIBUTING" else name for name in names]
        names = [name for name in names if name.partition("/")[0] not in CHAPTERS]
        found += _toctree(title, names)
    return found


def _toctree(caption: str, names: list[str]) -> str:
    if not names:
        return ""
    title = f":caption: {caption}\n" if caption else ""
    return "\n\n```{toctree}\n:hidden:\n" + title + "\n" + "\n".join(names) + "\n```\n"
