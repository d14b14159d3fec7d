"""Names: values of the argument `method`. `tools/method_names.py` writes this file."""
from typing import Literal

MethodName = Literal[
    "auto",
    "brute-force",
    "ray-engine",
    "grid",
    "grid-proximity",
    "kd-restart",
    "kd-backtrack",
    "kd-push-down",
    "kd-short-stack",
    "kd-stack",
    "kd-texture-stack",
    "kd-ropes",
    "kd-packet",
    "kd-ropes-packet",
    "bvh-threaded",
    "bvh-stack",
    "bvh-packet",
    "geometry-image",
    "bih",
    "ray-tiles",
    "ray-hierarchy",
    "ray-classification",
    "visibility-field",
    "tree-unit",
]
