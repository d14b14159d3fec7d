"""Page: one HTML file that traces a scene in a browser, without a server or the network."""
from __future__ import annotations

import base64
import hashlib
import json
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.files import replacing
from ..errors import LimitError, OptionError
from ..gl.shader import ROOT
from ..scene.scene import Scene
from .export import PageData, WebMethod, export_method

HERE = Path(__file__).parent
SCRIPTS = ("unpack.js", "player.js", "passes.js", "controls.js")     # one script in the page
SIDE = 512          # of the canvas, in pixels
MOST_BYTES = 64 << 20


def write_page(scene: Scene, names: list[str], path: str,
               left_out: dict[str, str] | None = None) -> list[WebMethod]:
    """Write the page of a scene, and return its methods.

    Parameters
    ----------
    left_out : receives, by name, why a method does not run on this scene. The page then leaves the
        method out

    Raises
    ------
    OptionError
        no method runs in a browser, or ``left_out`` is None and a method does not
    LimitError
        the page would be larger than MOST_BYTES
    """
    tables = PageData()
    methods = []
    for name in names:
        try:
            methods.append(export_method(scene, name, tables))
        except OptionError as reason:
            if left_out is None or len(left_out) == len(names) - 1:
                raise
            left_out[name] = str(reason)
    text = page_text(scene, methods, tables)
    if len(text) > MOST_BYTES:
        raise LimitError(f"the page would have {len(text) >> 20} MiB; take fewer methods or a "
                         f"smaller scene (at most {MOST_BYTES >> 20} MiB)")
    with replacing(path) as file:
        file.write_text(text, encoding="utf-8")
    return methods


def page_text(scene: Scene, methods: list[WebMethod], tables: PageData) -> str:
    """Return the text of a page."""
    own = [(ROOT / "web" / name).read_text() for name in ("whole.vert", "show.frag", "alive.frag")]
    first = len(tables.texts)
    told = {"methods": [asdict(one) for one in methods], "texts": [*tables.texts, *own],
            "tables": tables.tables, "whole": first, "show": first + 1, "alive": first + 2,
            "triangles": tables.triangles,
            "camera": {name: _plain(getattr(scene.camera, name))
                       for name in ("eye", "target", "up", "fov")}}
    script = "\n".join((HERE / name).read_text() for name in SCRIPTS)
    style = (HERE / "page.css").read_text()
    policy = (f"default-src 'none'; script-src '{_digest(script)}'; "
              f"style-src '{_digest(style)}'")
    # "<" cannot end the element of the description, nor begin markup.
    description = json.dumps(told).replace("<", "\\u003c")
    title = escape(f"{scene.title} in WebGL 2")
    return _PAGE.format(policy=policy, title=title, style=style, script=script,
                        description=description, side=SIDE,
                        triangles=f"{len(scene.triangles):,}")


def _plain(value: Any) -> Any:
    return float(value) if np.ndim(value) == 0 else [float(x) for x in value]


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title><style>{style}</style></head><body>
<h1>{title}</h1>
<p class="hint">{triangles} triangles. Fragment programs trace every picture on your own graphics
card, pass by pass, as in the papers of 2002-2007. Drag to turn the scene; click a pixel to read
its ray. The address keeps what you chose, so that you can share it.</p>
<p id="message"></p>
<main><div>
<div class="controls">
<label>method <select id="method"></select></label>
<label>schedule <select id="schedule"></select></label>
<label>rays <select id="size"><option>64</option><option selected>128</option><option>256</option>
<option>512</option></select></label>
<label><input id="heat" type="checkbox"> steps as heat</label>
</div>
<canvas id="picture" role="img" aria-label="The traced picture"
 width="{side}" height="{side}"></canvas>
<div class="controls"><label for="pass">steps</label>
<input id="pass" type="range" min="1" value="1"></div>
<p id="counts"></p>
<p id="summary"></p>
</div><div>
<p id="verdict" aria-live="polite">The test rays are being traced.</p>
<p id="selftest" data-state="running"></p>
<pre id="ray">Click a pixel of the picture.</pre>
<label>program of the pass <select id="kernel"></select></label>
<pre id="text"></pre>
</div></main>
<script type="application/json" id="description">{description}</script>
<script>{script}</script>
</body></html>
"""
