"""Kd-trees: traversal by restart, backtrack, push-down, stacks and ropes."""
