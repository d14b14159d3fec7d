"""Figures that go beyond the survey, each beside its own helpers."""
