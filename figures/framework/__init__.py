"""The code that all figures share: cells (measurements), measuring, comparison,
verdicts and pages."""
