"""`vibrodrive`, and `python -m vibrodrive`, which is the same."""

from __future__ import annotations

import signal
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C while the commands are imported: not with a traceback
    from vibrodrive.cli import main as run

    run()


if __name__ == "__main__":
    main()
