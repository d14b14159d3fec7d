"""Packed tables: the page's script recovers every bit of a table."""
from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gpgpu_rt.web.packing import packed_table
from gpgpu_rt.web.page import HERE

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
                None)
RNG = np.random.default_rng(3)


def bits(*words: int) -> np.ndarray:
    return np.array(words, "<u4").view("<f4")


def records() -> np.ndarray:
    """Returns records of two texels.

    Channel 0 of the first texel is the key that divides the records into classes (packing.py). The
    key is 0, 1, 2 or a running number from 3 on. Channel 1 is an integer whose formula depends on
    the class. The second texel holds floats of both signs.
    """
    kind = RNG.integers(0, 5, 500)
    table = np.zeros((1000, 4), np.float32)
    table[::2, 0] = np.where(kind < 3, kind, 2 + np.cumsum(kind >= 3))
    table[::2, 1] = np.where(kind < 3, np.arange(500) + RNG.integers(1, 3, 500),
                             9000 + np.cumsum(kind))
    table[1::2, :3] = np.cumsum(RNG.normal(size=(500, 3)), 0)
    return table


TABLES = {
    "empty": np.zeros((0, 4)), "one": np.array([[7.0]]), "zeros": np.zeros(12),
    "special": bits(0x80000000, 0, 0x7f800000, 0xff800000, 0x7fc12345, 0xffc00001, 1, 0x80000001),
    "bits": RNG.integers(0, 1 << 32, 3001, dtype=np.uint32).view(np.float32),
    "integers": RNG.integers(-(1 << 24), (1 << 24) + 1, (333, 4)).astype(float),
    "negative": np.array([3, -2, -1, 0, 1, 2, 3.0]), "late float": np.append(np.arange(50000), .5),
    "records": records(), "seventh": np.arange(7 * 3).reshape(7, 3)}


def test_records_are_divided_by_their_class() -> None:
    codes = dict(packed_table(records())["columns"])
    assert codes[0] == ["integer", "fresh", 1] and codes[1][0] == 0
    assert codes[1][2][3][1] == "previous" and codes[1][2][0][1] == "row"


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_every_bit_is_recovered(tmp_path: Path) -> None:
    assert CHROMIUM is not None
    tables = {name: np.asarray(table, np.float32) for name, table in TABLES.items()}
    told = json.dumps({name: packed_table(table) for name, table in tables.items()})
    page = tmp_path / "page.html"
    page.write_text(f"<pre id=found></pre><script>{(HERE / 'unpack.js').read_text()}"
                    f"(async () => {{ const found = {{}};"
                    f"for (const [name, one] of Object.entries({told})) {{"
                    "const values = await unpacked(one); found[name] = Array.from(new Uint32Array("
                    "values.buffer, 0, values.length)); }"
                    "document.getElementById('found').textContent = JSON.stringify(found); })();"
                    "</script>")
    dom = subprocess.run([CHROMIUM, "--headless=new", "--no-sandbox", "--dump-dom",
                          "--virtual-time-budget=20000", f"file://{page}"], capture_output=True,
                         text=True, timeout=100, check=True).stdout
    found = json.loads(re.search("<pre id=.found.>(.*?)</pre>", dom, re.S)[1])
    for name, table in tables.items():
        assert found[name] == table.ravel().view(np.uint32).tolist(), name
