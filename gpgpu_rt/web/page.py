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
from ..gl.shader import resolve
from ..inspect.false_colours import RAMP, category
from ..rays.records import NO_TRIANGLE
from ..scene.scene import Scene
from ..traversal.live_tiles import TILE
from .described import MOST_KERNELS
from .export import TEST_SIDE, WebMethod, export_method
from .page_data import PageData

HERE = Path(__file__).parent
# The page joins these files, in this order, into a single script.
SCRIPTS = ("vectors.js", "unpack.js", "player.js", "passes.js", "selftest.js", "path.js",
           "visits.js", "space.js", "charts.js", "program.js", "controls.js", "start.js")
# The programs that belong to no method: they show and count the rays.
OWN = {"whole": "drivers/full_screen.vert", "show": "web/show.frag", "alive": "web/alive.frag"}
# Constants of these programs and of the scripts.
CONSTANTS = {"NO_TRIANGLE": NO_TRIANGLE, "TILE": TILE, "HEAT_COLOURS": len(RAMP)}
SIDE = 512          # side of the canvas in pixels
# The numbers of rays across the picture. The page opens with TEST_SIDE rays, so that its opening
# ray is one of the test rays.
SIZES = (TEST_SIDE, 128, 256, 512)
MOST_WIRES = 2000   # largest number of triangles whose edges the page draws in space
MOST_BYTES = 64 << 20


def write_page(scene: Scene, names: list[str], path: str,
               left_out: dict[str, str] | None = None, title: str = "",
               caption: str = "", index: str = "") -> list[WebMethod]:
    """Write the page of a scene, and return the page's methods.

    Parameters
    ----------
    left_out : receives name -> reason for each method that does not run on this scene; the page
        leaves such a method out
    title, caption : the page's heading, and a sentence below it. The default heading names the
        scene, and the method if there is only one
    index : the file in the same folder that lists all pages, for a link; "" for no link

    Raises
    ------
    OptionError
        if no method runs in a browser, or if ``left_out`` is None and a method does not run
    LimitError
        if the page would be larger than MOST_BYTES
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
    text = page_text(scene, methods, tables, title, caption, index)
    if len(text) > MOST_BYTES:
        raise LimitError(f"the page would have {len(text) >> 20} MiB; choose fewer methods or a "
                         f"smaller scene (at most {MOST_BYTES >> 20} MiB)")
    with replacing(path) as file:
        file.write_text(text, encoding="utf-8")
    return methods


def page_text(scene: Scene, methods: list[WebMethod], tables: PageData, title: str = "",
              caption: str = "", index: str = "") -> str:
    own = {name: tables.text(resolve(file, CONSTANTS).text) for name, file in OWN.items()}
    wires = _wires(scene, tables)
    told = {"methods": [asdict(one) for one in methods], "texts": tables.texts,
            "tables": tables.tables, "own": own, "constants": CONSTANTS,
            "opens": _opening(methods), "triangles": tables.triangles, "wires": wires,
            "heat": _plain(RAMP.ravel() / 255),
            "camera": {name: _plain(getattr(scene.camera, name))
                       for name in ("eye", "target", "up", "fov")}}
    script = "\n".join((HERE / name).read_text() for name in SCRIPTS)
    style = _kernel_colours() + (HERE / "page.css").read_text()
    policy = (f"default-src 'none'; script-src '{_digest(script)}'; "
              f"style-src '{_digest(style)}'")
    # Escape "<", so that the description cannot end its own element or begin markup.
    description = json.dumps(told).replace("<", "\\u003c")
    one = f"{methods[0].name} on " if len(methods) == 1 else ""
    link = f'<a id="all" href="{escape(index)}">All pages</a>\n' if index else ""
    return _PAGE.format(policy=policy, title=escape(title or f"{one}{scene.title} in WebGL 2"),
                        index=link, sizes="".join(map(_size_option, SIZES)),
                        caption=f'<p id="caption">{escape(caption)}</p>' if caption else "",
                        style=style, script=script, description=description, side=SIDE,
                        test_side=TEST_SIDE, costs="".join(map(_cost_row, methods)),
                        triangles=f"{len(scene.triangles):,}")


def _opening(methods: list[WebMethod]) -> str:
    """Return the method of the first picture. Avoid brute force: all its rays end together, so the
    steps of its search show nothing."""
    return next((one.name for one in methods if one.name != "brute-force"), methods[0].name)


def _size_option(size: int) -> str:
    return f"<option{' selected' if size == TEST_SIDE else ''}>{size}</option>"


def _cost_row(method: WebMethod) -> str:
    cells = [(f"{counts[0]:,.1f}", f"{counts[1]:,}") if counts else ("", "")
             for counts in (method.costs["steps"], method.costs["nodes"])]
    return (f'<tr data-method="{method.name}"><th scope="row">{method.name}</th>'
            + "".join(f"<td>{text}</td>" for pair in cells for text in pair) + "</tr>")


def _kernel_colours() -> str:
    names = [f"--kernel-{phase}: #{bytes(category(phase)).hex()}"
             for phase in range(1, MOST_KERNELS + 1)]
    return f":root {{ {'; '.join(names)} }}\n"


def _wires(scene: Scene, tables: PageData) -> dict[str, Any]:
    """Return the triangles whose edges the page draws. In a large scene, these are the largest
    triangles and a sample of the rest. Corners are integers from 0 to 4095 across the scene's
    box."""
    corners = scene.triangles.astype(np.float64)
    if len(corners) > MOST_WIRES:
        edges = corners[:, 1:] - corners[:, :1]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        order, half = np.argsort(-areas, kind="stable"), MOST_WIRES // 2
        rest = order[half:]
        corners = corners[np.concatenate([order[:half], rest[::-(-len(rest) // half)]])]
    points = scene.triangles.reshape(-1, 3) if len(scene.triangles) else np.zeros((1, 3))
    lo, hi = points.min(0).astype(np.float64), points.max(0).astype(np.float64)
    steps = np.round(4095 * (corners - lo) / np.maximum(hi - lo, 1e-300))
    return {"lo": _plain(lo), "hi": _plain(hi),
            "data": tables.values(steps.reshape(-1, 3).astype(np.float32))}


def _plain(value: Any) -> Any:
    return float(value) if np.ndim(value) == 0 else [float(x) for x in value]


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title><style>{style}</style></head><body>
{index}<h1>{title}</h1>
{caption}
<p class="hint">{triangles} triangles. Fragment programs trace every picture on your own graphics
card, pass by pass, as in the papers of 2002-2007. Drag a picture to turn it; click a pixel to
follow its ray. The address keeps what you chose, so that you can share it.</p>
<p role="alert" id="message"></p>
<p role="status" id="unread"></p>
<main>
<div class="column">
<section>
<div class="controls">
<label>method <select id="method"></select></label>
<label>schedule <select id="schedule"></select></label>
<label>rays <select id="size">{sizes}</select></label>
</div>
<div id="frame"><canvas id="picture" role="img" aria-label="The traced picture"
 width="{side}" height="{side}"></canvas><i id="mark" hidden></i></div>
<div id="steps">
<div class="controls"><button id="play" type="button">play</button>
<label for="pass">step</label><output id="step" for="pass"></output>
<button id="end" type="button">end of this ray</button>
<span id="alive-text"></span></div>
<canvas id="alive" role="img" aria-label="Live rays after each step" width="512" height="56">
</canvas>
<input id="pass" type="range" min="1" value="1">
<p id="waits"></p>
<div class="controls"><label><input id="heat" type="checkbox"> steps as heat</label>
<label>brightest at <input id="scale" type="number" min="1"></label>
<button id="percentile" type="button"
 title="the number of steps that 99 % of the rays of this picture do not exceed">99 %</button>
</div>
<canvas id="ramp" role="img" aria-label="Colours of the heat map" width="256" height="12"></canvas>
<p id="ticks"></p>
</div>
</section>
<section class="second">
<p id="counts"></p>
<p id="summary"></p>
<details><summary>How the method works</summary><div id="about"></div></details>
<table id="costs"><caption>Cost of a ray by each method, for {test_side} x {test_side} test rays
</caption><thead><tr><th rowspan="2" scope="col">method</th>
<th colspan="2" scope="colgroup">steps</th>
<th colspan="2" scope="colgroup">visited nodes or cells</th></tr><tr><th scope="col">mean</th>
<th scope="col">largest</th><th scope="col">mean</th><th scope="col">largest</th></tr></thead>
<tbody>{costs}</tbody></table>
<p id="verdict" aria-live="polite">The test rays are being traced.</p>
<p id="selftest" data-state="running"></p>
<pre id="ray"></pre>
<details id="fields"><summary>What the fields of the state mean</summary><div></div></details>
</section>
</div>
<div class="column">
<section>
<canvas id="space" role="img" aria-label="The ray in space" width="720" height="720"></canvas>
<p class="hint">The mouse wheel, or a pinch, zooms the drawing.</p>
<p id="space-text"></p>
</section>
<section class="second">
<label>program of the pass <select id="kernel"></select></label>
<div id="text"></div>
</section>
</div>
</main>
<script type="application/json" id="description">{description}</script>
<script>{script}</script>
</body></html>
"""
