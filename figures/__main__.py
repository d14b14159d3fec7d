"""``python -m gpgpu_rt.figures``: measure what is missing, then draw every figure."""
from __future__ import annotations

import signal
import sys

from gpgpu_rt.interrupts import Command, run


def main() -> int:
    """Run the command that ``sys.argv`` names, and return its exit status."""
    # Let SIGTERM end the command as Ctrl-C does. Otherwise paused worker processes would remain.
    return run(_load, also=(signal.SIGTERM,))


def _load() -> Command:
    # Import here, where `run` handles Ctrl-C: then Ctrl-C during the import prints no traceback.
    from .command import main
    return main


if __name__ == "__main__":
    sys.exit(main())
