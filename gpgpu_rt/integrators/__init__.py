"""Integrators: what rays are traced for a picture, and what they add to it."""
