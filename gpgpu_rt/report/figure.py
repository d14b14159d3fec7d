"""A figure as ``make figures`` wrote it, NAME.md and NAME.png, as a part of the page."""
from __future__ import annotations

import html
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ..errors import Error, how_to_install
from .images import image_tag, png_uri

SHORT = 3000     # characters of Markdown up to which the text of a figure lies open


@dataclass(frozen=True)
class Figure:
    """A figure that is there.

    Attributes
    ----------
    name : as ``python -m gpgpu_rt.figures --only`` knows it
    folder : where its files are
    """

    name: str
    folder: Path

    @property
    def text(self) -> str:
        """Its Markdown."""
        try:
            return (self.folder / f"{self.name}.md").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as failure:
            raise Error(f"cannot read {self.folder / self.name}.md: {failure}") from failure

    def section(self, width: int, known: Collection[str]) -> str:
        """HTML: title, chart, and the text with its tables.

        Parameters
        ----------
        width : of pictures, pixels at most
        known : figures of the page, to which links stay links
        """
        lines = self.text.strip().splitlines()
        title = self.name
        if lines and lines[0].startswith("# "):
            title, lines = lines[0][2:], lines[1:]
        body = "\n".join(lines)
        text = to_html(body, self.folder, width, known)
        chart = self.folder / f"{self.name}.png"
        drawn = "" if f"({chart.name})" in body else _picture(chart, title, width)
        opened = " open" if len(body) <= SHORT else ""
        return (f'<section class="figure" id="{html.escape(self.name)}">'
                f"<h3>{html.escape(title)}</h3>{drawn}"
                f"<details{opened}><summary>Tables and remarks</summary>{text}</details>"
                "</section>")


def to_html(text: str, folder: Path, width: int, known: Collection[str] = ()) -> str:
    """Markdown as HTML that asks nothing of anywhere: pictures beside it are taken in, links to
    figures stay within the page, other relative ones become text."""
    try:
        from markdown_it import MarkdownIt
    except ImportError:
        raise Error(f"the report needs markdown-it-py; {how_to_install('report')}") from None
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1]) + 2)}"
        for child in token.children or ():
            _within(child, folder, known)
    made = reader.renderer.render(tokens, reader.options, {})
    made = re.sub(r'<img src="([^"]*)" alt="([^"]*)"[^>]*>', lambda match: _embedded(
        folder, html.unescape(match[1]), html.unescape(match[2]), width), made)
    return made.replace("<table>", '<div class="wide"><table>').replace("</table>",
                                                                        "</table></div>")


def _within(token: Any, folder: Path, known: Collection[str]) -> None:
    """Turn a link to a figure's file into one within the page, and any other into text."""
    if token.type != "link_open":
        return
    name = Path(str(token.attrGet("href"))).stem
    if name in known:
        token.attrSet("href", f"#{name}")
    else:
        token.tag, token.attrs = "span", {}


def _embedded(folder: Path, url: str, text: str, width: int) -> str:
    """A picture that a text names, from the figures' folder alone: a page may be passed on."""
    name = unquote(url)
    try:
        path = (folder / name).resolve()
        if path.is_relative_to(folder.resolve()):
            return _picture(path, text, width)
    except (OSError, ValueError):       # a name that no file can have
        pass
    return _lacking(name)


def _lacking(name: str) -> str:
    return f'<p class="missing">No picture {html.escape(name)}.</p>'


def _picture(path: Path, text: str, width: int) -> str:
    try:
        return image_tag(png_uri(path, width), text)
    except (OSError, ValueError):
        return _lacking(path.name)
