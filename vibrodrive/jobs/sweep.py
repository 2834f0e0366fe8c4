"""Run a sweep into a file: start or resume the sweep, show its progress, and leave a file that can be resumed."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from types import ModuleType
from typing import TYPE_CHECKING

from vibrodrive.errors import ConfigError, Failed, NoResult, Unwritable
from vibrodrive.jobs.progress import Show, Tally, duration, shown
from vibrodrive.jobs.signals import Interrupted
from vibrodrive.model.described import counted
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import how_repeated
from vibrodrive.store.layout import Origin
from vibrodrive.store.writer import Writer, open_writer
from vibrodrive.version import __version__

if TYPE_CHECKING:
    from vibrodrive.jit.compilation import Compilation


@dataclass(frozen=True)
class Job:
    """A sweep to run: plan, configuration, file and resources."""

    plan: Plan
    origin: Origin
    path: Path
    threads: int | None = None
    dask: str | None = None
    overwrite: bool = False
    executor: Executor | None = None


def run(job: Job, show: Show | None, after: float | None = None) -> list[str]:
    """Compute the missing blocks of a file, and return a text for each point at which a function of the record raised.

    `show` shows the progress, as `shown` does, and a summary. An exception in this thread, such as KeyboardInterrupt,
    ends the sweep with a file that can be resumed; an Interrupted then has the progress in its message.

    Raises the exceptions of `open_writer` before the computation, and ConfigError if a cluster cannot be reached.
    """
    work = _Work(job)
    try:
        with shown(show, work.look, after):
            work.execute()
    except Interrupted as signal:
        raise Interrupted(f"{signal}{work.progress()}") from None
    finally:
        if show is not None:
            work.print_news(show)
    if show is not None:
        show.say(work.summary)
    return work.tally.raised


class _Work:
    def __init__(self, job: Job) -> None:
        self.job = job
        self.tally = Tally()
        self.summary = ""
        self.compilation: Compilation | None = None  # set when Numba is loaded
        self._writer: Writer | None = None
        self._news: list[str] = []

    def print_news(self, show: Show) -> None:
        """Print the messages since the last call."""
        while self._news:
            show.say(self._news.pop(0))

    def look(self, show: Show) -> None:
        """Print new messages, and show the progress."""
        self.print_news(show)
        show.look(self.tally.line, self.compilation)

    def progress(self) -> str:
        """Return the part of a message that says what was computed before an interruption."""
        if self._writer is None or not self.tally.points:
            return " before anything was computed"
        return f": {self.job.path} contains {_done(self._writer)}"

    def execute(self) -> None:
        """Open the file, compute its missing blocks and close the file. Raises the exceptions of `run`."""
        job, path = self.job, self.job.path
        # the connection comes first, so that no file is made if the cluster cannot be reached
        with _executor(job.dask, self._watch_workers) as cluster:
            executor = cluster if job.executor is None else job.executor
            fresh = job.overwrite or not path.exists()
            writer = open_writer(path, job.plan, job.origin, overwrite=job.overwrite)
            self._writer = writer
            try:
                if not fresh:
                    self._check(writer)
                self._complete(writer, executor)
                self.tally.stage = "waiting for the disk"
                writer.close()
            except BaseException as error:  # KeyboardInterrupt in the main thread, too
                of_file = isinstance(error, Unwritable | NoResult)
                with contextlib.suppress(Unwritable):  # the first error is the reason
                    writer.close(sync=isinstance(error, Exception) and not of_file)
                if isinstance(error, Unwritable) and error.errno != errno.ENOENT:  # the file is not gone
                    raise Unwritable(error.errno, f"{error.strerror}; {_held(writer)}", str(path)) from None
                if of_file or not isinstance(error, Exception):
                    raise
                raise Failed(f"{path}: {_one_line(error)}; {_held(writer)}") from error

    def _watch_workers(self, workers: int) -> None:
        """Report a cluster without workers. Another thread calls this method periodically."""
        if workers == 0 and not self.tally.waiting:
            self._news.append(f"--dask {self.job.dask}: the cluster has no workers; the sweep waits for them")
        self.tally.waiting = "" if workers else "waiting for workers"

    def _check(self, writer: Writer) -> None:
        def watch(done: int, total: int) -> None:
            self.tally.stage = f"checking the existing file: {100 * done / total:.0f} %"

        writer.check(watch)
        path, done, blocks = self.job.path, writer.done.sum(), len(writer.done)
        for k, fault in sorted(writer.repaired.items()):
            self._news.append(f"{path}: block {k} is damaged ({fault}) and is computed again")
        if done < blocks and writer.made_by != __version__:
            self._news.append(f"{path}: begun by vibrodrive {writer.made_by}, continued by {__version__}")
        if 0 < done < blocks:
            share = 100 * done / blocks
            self._news.append(f"{path}: resumed with {done} of {blocks} blocks ({share:.1f} %)")

    def _complete(self, writer: Writer, executor: Executor | None) -> None:
        missing = writer.missing()
        if not missing:
            self.summary = f"{self.job.path} is complete: nothing to compute"
            return
        prepared = self._prepare(writer, local=executor is None)
        run_blocks = _computing(writer.plan).run_blocks
        plan, tally = writer.plan, self.tally
        lengths = [stop - start for start, stop in plan.blocks()]
        tally.start(plan, plan.n_points - sum(lengths[k] for k in missing))
        computed = run_blocks(plan, missing, threads=self.job.threads, executor=executor)
        with contextlib.closing(computed) as blocks:
            for block in blocks:
                writer.write(block)
                tally.add(block)
        took = duration(monotonic() - tally.began)
        self.summary = f"{self.job.path}: {counted(tally.fresh, 'point')} in {took} ({tally.speed(', ')}), {prepared}"

    def _prepare(self, writer: Writer, local: bool) -> str:
        """Load or compile the kernels before the time of the sweep starts, and return a text about their time."""
        self.tally.stage = "loading the kernels"
        began = monotonic()
        from vibrodrive.jit.compilation import compilation

        self.compilation, before = compilation, compilation.seconds
        if not local:
            self.tally.elsewhere = "waiting for workers, which compile missing kernels"
            return "including the time of workers to load or compile the kernels"
        _computing(writer.plan).load_kernels(writer.plan)
        compiled = compilation.seconds - before
        loaded = f"after {duration(monotonic() - began - compiled)} to load the kernels"
        return f"{loaded} and {duration(compiled)} to compile them" if compiled else loaded


def _computing(plan: Plan) -> ModuleType:
    """Return the module that computes the blocks of a plan. It is imported late, because it loads Numba."""
    if plan.per_point:
        from vibrodrive.stability import per_point

        return per_point
    from vibrodrive.batch import sweep

    return sweep


REACH_SECONDS = 10  # largest time for the answer of a scheduler, in seconds
WORKERS_SECONDS = 1.0  # interval of reading the number of workers of a cluster, in seconds


@contextlib.contextmanager
def _executor(address: str | None, watch: Callable[[int], None]) -> Iterator[Executor | None]:
    """Yield an executor of the cluster at an address, or None without an address.

    Meanwhile `watch` is called periodically with the number of workers.
    """
    if address is None:
        yield None
        return
    try:
        from distributed import Client

        for name in ("concurrent.futures", "distributed"):  # their logs would add tracebacks to the messages below
            logging.getLogger(name).setLevel(logging.CRITICAL)
        asyncio.run(asyncio.wait_for(_reach(address), REACH_SECONDS + 1))
        client = Client(address, timeout=f"{REACH_SECONDS}s", set_as_default=False)
    except ImportError:
        raise ConfigError("--dask needs the extra `dask`: pip install 'vibrodrive[dask]'") from None
    except TimeoutError as error:
        why = _one_line(error) if str(error) else f"no scheduler answered within {REACH_SECONDS} s"
        raise ConfigError(f"--dask {address}: {why}") from None
    except Exception as error:  # any error of the transport, such as TLS without certificates
        raise ConfigError(f"--dask {address}: {_one_line(error)}") from None
    ended = threading.Event()

    def poll() -> None:
        with contextlib.suppress(Exception):  # the computation reports a lost connection
            while not ended.wait(WORKERS_SECONDS):
                watch(len(client.nthreads()))

    with client:
        watch(len(client.nthreads()))
        threading.Thread(target=poll, name="workers", daemon=True).start()
        try:
            yield client.get_executor()
        finally:
            ended.set()


async def _reach(address: str) -> None:
    """Test the connection, because a Client that cannot connect leaves threads and tracebacks behind."""
    from distributed.core import connect
    from distributed.security import Security

    comm = await connect(address, timeout=REACH_SECONDS, **Security().get_connection_args("client"))
    comm.abort()


def _held(writer: Writer) -> str:
    return f"{_done(writer)} are in the file; repeat {how_repeated(writer.plan.record)} to resume it"


def _done(writer: Writer) -> str:
    return f"{writer.done.sum()} of {len(writer.done)} blocks"


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
