"""What all pages of a server share: the thread that computes, the process for exact work, and the pace.

Nothing here imports Numba before the first page has been built: it takes the browser longer to load that page than the
worker to load Numba and the kernels meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from vibrodrive.explorer.aside import Aside
from vibrodrive.explorer.pace import Pace
from vibrodrive.explorer.worker import Rank, Slot, Worker
from vibrodrive.jit.slices import Halt

WARMING = Slot(-1, Rank.EXPORT)  # of no page
OPENING_SECONDS = 1.0  # for a page to be opened, and built before kernels are loaded


class Client(Protocol):
    """A page, as far as the engine knows it."""

    def failed(self, rank: Rank, error: BaseException) -> None:
        """A task of this page broke off."""


class Engine:
    """What computes for the pages. `tasks` imports the module with `TASKS` and `warm_picture`, and with it Numba."""

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
        """Load what a first picture needs, now."""
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
    """Load what exact work needs, in the process for it; and compile what the worker is to find compiled."""
    from vibrodrive.explorer import exact, motion

    exact.warm()
    motion.warm()
