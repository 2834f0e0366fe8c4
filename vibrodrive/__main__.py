"""Entry point of `vibrodrive` and of `python -m vibrodrive`."""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # the import of `typing` takes 5 ms, during which Ctrl-C would give a traceback
if TYPE_CHECKING:
    from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit."""
    signal.signal(signal.SIGINT, _stop)  # while the commands are imported
    _open_closed_streams()
    os.environ["MPLBACKEND"] = "agg"  # commands write figures to files and need no display
    os.environ["HDF5_USE_FILE_LOCKING"] = "FALSE"  # result files have a lock of this program (store/lock.py)
    from vibrodrive.cli import main as run

    run()


def _stop(signum: int, frame: object) -> None:
    os.write(2, b"vibrodrive: stopped by SIGINT\n")
    os._exit(130)


def _open_closed_streams() -> None:
    """Open standard streams that the shell has closed (`2>&-`) on the null device.

    Otherwise the first file that is opened gets their number, and messages are written into that file.
    """
    for name, number in (("stdin", 0), ("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is the number of this stream
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115 (open until the end)


if __name__ == "__main__":
    main()
