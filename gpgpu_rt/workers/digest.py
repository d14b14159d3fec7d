"""Digest: a hash by which processes and machines recognise equal values."""
from __future__ import annotations

import hashlib
import pickle
from typing import Any

from ..errors import Error


def digest(value: Any) -> str:
    """Return the SHA-256 digest of a value's pickle. The digest depends on the names of functions
    and classes, not on their code.

    Raises
    ------
    Error
        if the value cannot be sent to another process, such as a function within a function
    """
    try:
        told = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError) as failure:
        raise Error(f"a value cannot be sent to other processes ({failure}); define its functions "
                    "at the top level of a module") from failure
    return hashlib.sha256(told).hexdigest()
