"""Palette: colours and markers of series.

The colours, by Okabe and Ito, can be distinguished with the common kinds of colour blindness.
Each colour has its own marker, for prints in grey.
"""
from __future__ import annotations

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "D", "s", "^", "v", "P", "X")
GREY = "#8c8c8c"

# Colour and marker of the three series that most pages compare: measured here, published in the
# papers, predicted by the model.
HERE, PUBLISHED, PREDICTED = zip(COLOURS[:3], MARKERS[:3])
