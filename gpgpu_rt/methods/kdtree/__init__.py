"""Kd-trees: restart, backtrack, push-down, stacks and ropes."""
