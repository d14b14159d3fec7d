"""In README, CONTRIBUTING, the paper and docs, each picture exists, and each link to a file or a
heading leads to an existing target. The index pages list every page."""
from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.glob("**/*.md")])
PICTURES = sorted(path for path in DOCS.glob("**/*") if path.suffix in (".png", ".gif", ".jpg"))
MOST_BYTES = 1_500_000      # largest size of a picture; a page loads all of its pictures
_LINK = re.compile(r"(?<!!)\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^)\s]+)\)")
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"(?ms)^```.*?^```$|`[^`\n]*`")


def _text(page: Path) -> str:
    """Returns a page without its code. In code, brackets are no links and # begins no heading."""
    return _FENCE.sub("code", page.read_text(encoding="utf-8"))


def _anchors(page: Path) -> set[str]:
    """Returns the anchors of a page's headings, as code hosts spell them."""
    text = re.sub(r"(?ms)^```.*?^```$", "", page.read_text(encoding="utf-8"))
    names = [re.sub(r"[^\w\- ]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", head).lower()
                    ).replace(" ", "-") for head in re.findall(r"(?m)^#+ (.+)$", text)]
    count: Counter[str] = Counter()
    found = set()
    for name in names:      # the second heading with the same name gets the suffix -1
        found.add(f"{name}-{count[name]}" if count[name] else name)
        count[name] += 1
    return found


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def _broken(page: Path) -> list[str]:
    """Returns a page's links to files or headings that do not exist. Links to the web are left
    out."""
    found = []
    for link in _LINK.findall(_text(page)):
        if link.startswith(("http:", "https:")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists() or anchor and anchor not in _anchors(target):
            found.append(link)
    return found


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_links_lead_somewhere(page: Path) -> None:
    assert _broken(page) == []


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_pictures_are_there_and_described(page: Path) -> None:
    for words, name in _PICTURE.findall(_text(page)):
        assert words and (page.parent / name).resolve() in PICTURES, name


@pytest.mark.parametrize("path", PICTURES, ids=_name)
def test_each_picture_is_shown_and_small(path: Path) -> None:
    with Image.open(path) as image:
        image.load()
        assert image.width <= 1600
    assert path.stat().st_size < MOST_BYTES
    assert any((page.parent / name).resolve() == path for page in PAGES
               for _, name in _PICTURE.findall(_text(page)))


@pytest.mark.parametrize("page", sorted((DOCS / "reference").glob("*.md")), ids=_name)
def test_a_list_that_is_only_on_the_site_can_be_found(page: Path) -> None:
    """In the repository, a page lacks its generated list. Instead, the page names a command that
    prints the list, or the files with the list's entries."""
    before, mark, _ = page.read_text(encoding="utf-8").partition("<!-- generated: ")
    assert not mark or re.search(r"`(gpgpu-rt [A-Za-z]|make docs|records\.py)", before)


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A [b](#c) `d`\n\n# Same\n\n# Same\n\n```sh\n# no heading\n```\n"
                    "[0](page.md) [1](#a-b-d) [2](#same-1) [3](#no-heading) [4](gone.md) "
                    "[![p](p.png)](far.md) [5](page.md#same-2) `[6](code.md)`\n")
    assert _broken(page) == ["#c", "#no-heading", "gone.md", "far.md", "page.md#same-2"]


def test_the_indexes_list_each_page_once() -> None:
    """docs/index.md and docs/reference/index.md list each page of their own folders; the site's
    sidebar shows the same lists. This test does not check the folders tour, how-to and notes."""
    for folder in (DOCS, DOCS / "reference"):
        index = folder / "index.md"
        listed = Counter((folder / name).resolve() for name in re.findall(
            r"(?m)^- \[[^\]]*\]\(([^)#]+)\)", index.read_text(encoding="utf-8")))
        own = {path for path in folder.glob("*.md") if path != index}
        assert own <= set(listed) and set(listed.values()) == {1}, own - set(listed)
