"""``python -m gpgpu_rt`` runs the same command as ``gpgpu-rt``."""
from __future__ import annotations

import gc
import sys

from .interrupts import Command, run


def main() -> int:
    """Run the command that ``sys.argv`` names and return the exit status."""
    return run(_load)


def _load() -> Command:
    # Import the command only here, because `run` already handles Ctrl-C: an interrupt during the
    # import prints no traceback. The garbage collector would only cost time meanwhile.
    gc.disable()
    from .cli.main import import_command, main
    import_command(sys.argv[1:])
    gc.freeze()
    gc.enable()
    return main


if __name__ == "__main__":
    sys.exit(main())
