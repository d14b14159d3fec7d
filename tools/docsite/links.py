"""Links of pages: changes the links of the project's pages into links that work on the site."""
from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
# Pages outside docs/ that the site has too, and their names on the site.
MOVED = {ROOT / "README.md": "index.md", ROOT / "CONTRIBUTING.md": "contributing.md"}
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"(?ms)^(```.*?^```$)")


def with_links(text: str, page: Path, name: str, keep: Callable[[Path], str]) -> str:
    """Returns a page's text with links that work on the site.

    Parameters
    ----------
    text : Markdown.
    page : The file of the text. Links are relative to this file.
    name : The page's name on the site, such as "notes/race.md".
    keep : Function that copies a file that is no page, and returns the copy's name on the site.
    """
    def changed(link: re.Match) -> str:
        picture, words, address = link.groups()
        if address.startswith(("http:", "https:", "#")):
            return link[0]
        words = _LINK.sub(changed, words)
        path, _, anchor = address.partition("#")
        target = (page.parent / path).resolve()
        place = _place(target, keep)
        if not place:
            return words
        relative = os.path.relpath(place, Path(name).parent)
        return f"{picture}[{words}]({relative}{'#' * bool(anchor)}{anchor})"

    parts = _FENCE.split(text)
    parts[0::2] = [_LINK.sub(changed, part) for part in parts[0::2]]
    return "".join(parts)


def _place(target: Path, keep: Callable[[Path], str]) -> str:
    """Returns a file's or folder's name on the site; "" for a folder without a page."""
    if target in MOVED:
        return MOVED[target]
    if target.is_dir():
        index = next((one for one in (target / "index.md", target / "README.md")
                      if one.exists() and one.is_relative_to(DOCS)), None)
        return str(index.relative_to(DOCS)) if index else ""
    return str(target.relative_to(DOCS)) if target.is_relative_to(DOCS) else keep(target)
