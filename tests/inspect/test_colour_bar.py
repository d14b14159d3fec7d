"""Tests of the colour bar below heat maps."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.inspect import false_colours


@pytest.mark.parametrize("width", [128, 256, 600])
def test_the_whole_label_of_a_colour_bar_is_drawn(monkeypatch, width: int) -> None:
    drawn = []
    monkeypatch.setattr(false_colours, "write", lambda pen, at, text: drawn.append((at, text)))
    bar = false_colours.colour_bar(100, "nodes visited per ray", width, beyond=True)
    label = [(at, text) for at, text in drawn if at[1] >= 2 * false_colours.LINE]
    assert " ".join(text for _, text in label) == (
        "nodes visited per ray (last colour: 100 and more)")
    for (left, top), text in label:
        assert left + false_colours.text_width(text) <= bar.width
        assert top + false_colours.LINE <= bar.height
    assert np.asarray(bar).shape[1] == width
