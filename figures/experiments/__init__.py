"""Figures that go beyond the survey, and the modules that measure them."""
