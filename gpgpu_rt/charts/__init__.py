"""Charts: the rules of all charts of the project. Needs matplotlib.

A bar begins at zero on a linear axis. On a logarithmic axis, dots show the numbers. Markers or
labels repeat what colours say, for colour-blind readers. A chart has no title, because its page
has one; panels may have titles. A PNG file holds a text that describes the chart.
"""
from .axes import linear_axis, log_axis, plain
from .canvas import FORMATS, plt, save
from .dots import Series, dot_rows, legend_of
from .labels import direct_labels
from .palette import COLOURS, GREY, HERE, MARKERS, PREDICTED, PUBLISHED

__all__ = ["COLOURS", "FORMATS", "GREY", "HERE", "MARKERS", "PREDICTED", "PUBLISHED", "Series",
           "direct_labels", "dot_rows", "legend_of", "linear_axis", "log_axis", "plain", "plt",
           "save"]
