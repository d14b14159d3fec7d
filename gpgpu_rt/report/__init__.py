"""The teaching page: every figure that there is, beside what was published, in one HTML file."""
from .chapters import CHAPTERS, Chapter
from .page import LIMIT, Report, write_report

__all__ = ["CHAPTERS", "LIMIT", "Chapter", "Report", "write_report"]
