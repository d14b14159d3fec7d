"""Palette: colours and markers of series. The colours are those of Okabe and Ito.

Readers with the common kinds of colour blindness can tell these colours apart. Each colour has a
different marker, so that a print in grey remains readable.
"""
from __future__ import annotations

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "D", "s", "^", "v", "P", "X")
GREY = "#8c8c8c"

# The colour and the marker of the three series that most pages compare: measured here, published
# in the papers, predicted by the model.
HERE, PUBLISHED, PREDICTED = zip(COLOURS[:3], MARKERS[:3])
