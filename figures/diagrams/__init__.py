"""Drawings for the survey's diagrams: a small scene, its trees and rays, and passes."""
