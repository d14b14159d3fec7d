"""``python -m gpgpu_rt`` runs the same command as ``gpgpu-rt``."""
from __future__ import annotations

import gc
import sys

from .interrupts import Command, run


def main() -> int:
    """Run the command that ``sys.argv`` names and return the exit status."""
    return run(_load)


def _load() -> Command:
    # Imported late: `run` already answers Ctrl-C here, so an early interrupt is silent.
    # The objects of a module live as long as the process, so the garbage collector finds nothing
    # among them. Imports without the collector take a tenth less time.
    gc.disable()
    from .cli.main import import_command, main
    import_command(sys.argv[1:])
    gc.freeze()
    gc.enable()
    return main


if __name__ == "__main__":
    sys.exit(main())
