"""The code that all figures share: cells, measuring, comparison, verdicts and pages."""
