"""Content: what tells whether two values are the same, here and in other processes."""
from __future__ import annotations

import hashlib
import pickle
from typing import Any


def digest(value: Any) -> str:
    """SHA-256 of a value, or of the name of what is known by its module."""
    return hashlib.sha256(pickle.dumps(value, pickle.HIGHEST_PROTOCOL)).hexdigest()
