"""The teaching page: every measured figure beside the papers' numbers, in one HTML file."""
from .chapters import CHAPTERS, Chapter
from .page import LIMIT, Report, write_report

__all__ = ["CHAPTERS", "LIMIT", "Chapter", "Report", "write_report"]
