"""Content: what tells whether two values are the same, here and in other processes."""
from __future__ import annotations

import hashlib
import pickle
from typing import Any

from ..errors import Error


def digest(value: Any) -> str:
    """SHA-256 of a value, or of the name of what is known by its module.

    Raises
    ------
    Error
        for what no other process can be told of, such as a function within another
    """
    try:
        told = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError) as failure:
        raise Error(f"other processes cannot be told of this ({failure}); define its functions "
                    "at the top of a module") from failure
    return hashlib.sha256(told).hexdigest()
