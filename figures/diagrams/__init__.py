"""Drawings for the survey's diagrams: a small scene with its trees and rays, and passes."""
