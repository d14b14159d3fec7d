"""Loads a page in headless Chromium, and reports its requests, its broken images and the errors of
its scripts."""
from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

# This script runs in the loaded page, and writes its findings into the document. Chromium then
# prints the document.
PROBE = """<script>addEventListener("load", () => {
const waits = [...document.images].map(i => { i.loading = "eager";
  return i.complete ? 0 : new Promise(done => { i.onload = i.onerror = done; }); });
Promise.all(waits).then(() => {
const found = {images: document.images.length,
  broken: [...document.images].filter(i => !i.complete || !i.naturalWidth).map(i => i.alt),
  requests: performance.getEntriesByType("resource").map(r => r.name)
    .filter(n => !n.startsWith("data:")),
  wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
  refused: window.refused, errors: window.failed};
scrollTo(0, 1e6);
const list = document.querySelector("#contents");
if (list) {
  const box = list.getBoundingClientRect(), text = document.querySelector("main");
  found.contents = {top: Math.round(box.top), open: list.querySelector("details").open,
    beside: box.right <= text.getBoundingClientRect().left};
}
const film = document.querySelector("figure.film");
if (film) {       // a new value of the slider shows its frame, and stops the film
  const slider = film.querySelector("input"), picture = film.querySelector("img");
  const before = picture.style.transform;
  slider.value = 3;
  slider.dispatchEvent(new Event("input"));
  found.film = {frame: Number(slider.value), button: film.querySelector("button").textContent,
    moves: picture.style.transform !== before};
}
const note = document.createElement("pre"); note.id = "probe";
note.textContent = JSON.stringify(found); document.body.append(note); }); });
window.refused = []; window.failed = [];
addEventListener("securitypolicyviolation", e => window.refused.push(e.blockedURI));
addEventListener("error", e => window.failed.push(String(e.message)));
</script>"""


def looked_at(page: Path, width: int, folder: Path) -> dict:
    """Returns the probe's findings for a page at a window width in pixels. Skips the test with a
    reason if Chromium is missing."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("Chromium is not installed")
    text = page.read_text(encoding="utf-8")
    # The page's own policy allows only the page's script. The copy allows the probe too.
    probed = re.sub("script-src '[^']*'", "script-src 'unsafe-inline'", text).replace(
        "</head>", PROBE + "</head>")
    copy = folder / f"probed{width}.html"
    copy.write_text(probed, encoding="utf-8")
    answer = subprocess.run(
        [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--window-size={width},2000",
         f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=20000", "--dump-dom",
         copy.as_uri()], capture_output=True, text=True, timeout=400)
    assert answer.returncode == 0, answer.stderr[-2000:]
    found = re.search(r'<pre id="probe">(.*?)</pre>', answer.stdout, re.S)
    assert found, answer.stdout[-500:] + answer.stderr[-500:]
    return json.loads(found[1].replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">"))
