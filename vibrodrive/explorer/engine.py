"""Resources that all pages of a server share: the worker thread, the process for exact results, and the pace.

Numba is imported after the first page has been built. While the browser loads that page, the worker loads Numba and the
kernels, which takes less time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from vibrodrive.explorer.aside import Aside
from vibrodrive.explorer.pace import Pace
from vibrodrive.explorer.worker import Rank, Slot, Worker
from vibrodrive.jit.slices import Halt

WARMING = Slot(-1, Rank.EXPORT)  # page -1 does not exist
OPENING_SECONDS = 1.0  # wait before the kernels are loaded, so that the first page can be opened and built


class Client(Protocol):
    """Interface of a page to the engine."""

    def failed(self, rank: Rank, error: BaseException) -> None:
        """Handle the failure of a task of this page."""


class Engine:
    """Computation for all pages. `tasks` imports the module with `TASKS` and `warm_picture`, and thereby Numba."""

    def __init__(
        self, threads: int | None, tasks: Callable[[], Any], imported: Callable[[], object] | None = None
    ) -> None:
        self.threads = threads
        self.tasks = tasks
        self.imported = imported
        self.worker = Worker(self._failed)
        self.aside = Aside(_warm_exact)
        self.pace = Pace()
        self.pages: dict[int, Client] = {}
        self.worker.request(WARMING, self._warm_unasked)

    def warm(self) -> None:
        """Load everything for the first picture without further delay."""
        self.worker.request(WARMING, self._warm)

    def _warm_unasked(self, halt: Halt) -> None:
        self.worker.pause(halt, OPENING_SECONDS)
        self._warm(halt)

    def _warm(self, halt: Halt) -> None:
        tasks = self.tasks()
        if self.imported is not None:
            self.imported()
        tasks.warm_picture(self, halt)

    def _failed(self, slot: Slot, error: BaseException) -> None:
        page = self.pages.get(slot.page)
        if page is not None:
            page.failed(slot.rank, error)

    def close(self) -> None:
        """End the thread and the process."""
        self.worker.close()
        self.aside.close()


def _warm_exact() -> None:
    """Load, in the separate process, the code for exact results; compile the kernels that the worker needs later."""
    from vibrodrive.explorer import exact, motion

    exact.warm()
    motion.warm()
