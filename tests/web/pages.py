"""Provides pages for tests. The text of each page is made only once for all tests, and a test may
change a copy of this text."""
from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from devtools import CHROMIUM, Browser

import gpgpu_rt as rt
from gpgpu_rt.web.export import export_method
from gpgpu_rt.web.page import page_text
from gpgpu_rt.web.page_data import PageData

in_browser = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@functools.cache
def written(names: tuple[str, ...], scene: str = "cornell") -> str:
    """Returns the page of a scene for the named methods."""
    found, tables = rt.load_scene(scene), PageData()
    return page_text(found, [export_method(found, name, tables) for name in names], tables)


def changed(text: str, change: Callable[[dict], None]) -> str:
    """Returns the page after ``change`` has changed its description."""
    told = json.loads(re.search(r'id="description">(.*?)</script>', text, re.S)[1])
    change(told)
    return re.sub(r'(id="description">).*?(</script>)', lambda found: found[1]
                  + json.dumps(told).replace("<", "\\u003c") + found[2], text, flags=re.S)


def opened(browser: Browser, folder: Path, text: str, choices: str = "") -> None:
    """Writes a page, opens it and waits for its first picture."""
    page = folder / "page.html"
    page.write_text(text)
    browser.open(page, choices)
    settle(browser)


def settle(browser: Browser) -> None:
    """Waits until the page shows the latest choices of its reader."""
    browser.wait("!busy && !wanted && element('picture').dataset.shown > 0")
