"""`vd.sweep`: a sweep that is called from Python. The results are in memory or in a file.

The job of `vibrodrive sweep` (jobs/sweep.py) writes or resumes the file, or raises an error.
"""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Unpack

from vibrodrive.batch.block import gather
from vibrodrive.jobs.progress import Tally, make_display, shown
from vibrodrive.model.choices import MethodLike
from vibrodrive.model.described import counted
from vibrodrive.model.keywords import Axis, Point, Points, takes
from vibrodrive.model.parameters import bad
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.records import functions
from vibrodrive.model.results import Results
from vibrodrive.model.slips import names_scene, unlikely, warn

OWN = ("path", "overwrite", "threads", "executor")  # keywords that do not change the results


@takes(Point[Axis])
def sweep(
    written: Mapping[str, Any],
    /,
    *,
    A: Axis | None = None,
    method: MethodLike = "certified",
    record: str | Callable[[Any], Any] | Sequence[str | Callable[[Any], Any]] = "section",
    points: Points | None = None,
    path: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    **parameters: Unpack[Point[Axis]],
) -> Results:
    """Simulate all combinations of the values of the axes, or a list of points.

    Each parameter that is a sequence is an axis, also a quantity of a scene. Such a quantity replaces its value in
    `scene`; without `scene`, all that are needed are given.

    Parameters
    ----------
    A : float or sequence of float, 0 to 1e9
        excitation amplitude, A = Ω0² a0 / (μ g cos α), dimensionless. Required, as this argument, in `points`, or by a
        scene. A sequence of n > 0 numbers, here and below, is an axis of this length, even if n = 1. The axes have the
        order of the keywords in the call.
    method : "certified", "muller" or "fixed"
        method that finds the end of a state, as in `simulate`, for all points.
    record : str, function, or sequence of these
        quantities to record. "section": the section points. "impacts": the main impacts, which have no faster impact
        within half an excitation period. "summary": a few numbers (period, impact speeds, energies, Lyapunov exponent,
        …) over one period of the motion, or over the record (see `Results`). "error": bounds of the errors of ξ and ξ'
        at the section points, and the period from which on a decision may be wrong. For "error" each motion is computed
        separately to its end. This takes several times as long, or many times as long if the motion repeats. "limit",
        alone: the limit k₂ at each point, as `limit` finds it. "failures", alone: the switches that a grid method
        misses. A function f(motion) that returns a number, or numbers by name, is a record, too.
    points : mapping of str to sequences of one length, optional
        parameters, and quantities of a scene, that change together, by name, for example a pandas.DataFrame. Point k
        has the k-th value of each. The points form one axis, `point`, with the values 0, 1, ….
    path : str or path, optional
        result file (.h5 or .nc) to write. Without a path all results are kept in memory. An existing file of the same
        sweep is resumed, even if `vibrodrive sweep` has written it. The file contains these arguments as a
        configuration, from which `vibrodrive sweep` can resume the file or write a bitwise equal file.
    overwrite : bool
        replace an existing result file. Other files are never replaced.
    threads : int, optional
        number of threads; by default the number of threads of Numba (`numba.set_num_threads`).
    executor : concurrent.futures.Executor, optional
        executor that computes the blocks, such as ``dask.distributed.Client.get_executor()``. Its workers must have the
        version and the sources of this package.
    **parameters

    Returns
    -------
    Results
        with the attributes axes, status (axes…), margin (axes…) and switches (axes…, 5), the number of switches into
        each `State`. The record "section" adds section (axes…, periods, 2), the values of ξ and ξ'; other records add
        other arrays (see `Results`). Results are bitwise equal for any number of threads, any executor, and with or
        without a file. With `path` the arrays are read from the file on access, as by `load`.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.
    ValueError
        TooLarge, if the results do not fit into memory or on the disk; Different, if the file belongs to another sweep
        (the message gives the keys that differ); NoResult, if the file is not a result file or cannot be read.
    RuntimeError
        Busy, if another process is writing the file; Failed, if the computation failed, or if a worker of the executor
        has other sources of this package. Written blocks remain.
    OSError
        if the system refuses to read or write the file.

    Warns
    -----
    UserWarning
        for values that are probably a mistake: those of `simulate`; an eta that varies although ε is 0; quantities of a
        scene that are not in SI units; a value twice on an axis.

    Examples
    --------
    A small bifurcation diagram, with and without a disturbance:

    >>> import numpy as np
    >>> import vibrodrive as vd
    >>> r = vd.sweep(A=np.linspace(3.0, 3.25, 6), eps=[0.0, 2e-4], transient=50, periods=20)
    >>> r
    <Results of 6 × 2 points, computed: A 3…3.25 (6), eps 0…0.0002 (2); section; certified, 50 + 20 periods; 12 OK>
    >>> r.section.shape  # A, eps, period, (ξ, ξ')
    (6, 2, 20, 2)
    >>> list(vd.sweep(eps=[0.0, 2e-4], A=[3.0, 3.1], transient=0, periods=1).axes)  # in the order of the call
    ['eps', 'A']

    Random starts, one for each point:

    >>> start = np.random.default_rng(seed=1)
    >>> starts = {"xi0": start.uniform(0, 8, 5), "dxi0": start.uniform(-3, 3, 5)}
    >>> several = vd.sweep(A=3.04, points=starts, transient=50, periods=20)
    >>> several.shape, list(several.points)
    ((5,), ['xi0', 'dxi0'])

    A machine in SI units, over its frequency in hertz. Its impact speeds in the Dataset are in m/s:

    >>> machine = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
    >>> over = vd.sweep(scene=machine, frequency=[20.0, 22.0], transient=50, periods=64, record="summary")
    >>> over.to_xarray().impact_speed_max.values.round(4), over.impact_speed_max.round(4)
    (array([0.0798, 0.0601]), array([1.7064, 1.4142]))

    The first sweep again, written to a file. A repeated call would resume this file:

    >>> s = vd.sweep(A=np.linspace(3.0, 3.25, 6), eps=[0.0, 2e-4], transient=50, periods=20, path="diagram.h5")
    >>> bool((s.section == r.section).all())
    True

    Notes
    -----
    Ctrl-C ends the call within a second. It also ends threads, and the tasks of an executor in threads or processes of
    this machine. Workers of Dask finish their current task, but the call does not wait for them. If a call takes
    longer than a second, it shows its progress on a terminal or in a notebook.
    """
    plan = make_plan({name: value for name, value in written.items() if name not in OWN})
    if not isinstance(overwrite, bool):
        raise TypeError(bad("overwrite", overwrite, "True or False"))
    if plan.per_point:
        from vibrodrive.stability.per_point import with_names

        plan = with_names(plan)
    warn(unlikely(plan, names_scene(written, plan)))
    if path is not None:
        return _into_file(plan, path, overwrite, threads, executor)
    if overwrite:
        raise ValueError(bad("overwrite", overwrite, "left out, or given together with path"))
    return _into_memory(plan, threads, executor)


def _into_memory(plan: Plan, threads: int | None, executor: Executor | None) -> Results:
    from vibrodrive.batch.sweep import collect
    from vibrodrive.jit.compilation import compilation

    tally = Tally()
    tally.start(plan)
    with shown(make_display("sweep"), lambda show: show.look(tally.line, compilation)):
        if not plan.per_point:
            return collect(plan, threads, executor, tally.add)
        from vibrodrive.stability.per_point import run_blocks

        with contextlib.closing(run_blocks(plan, threads=threads, executor=executor)) as blocks:
            results = gather(plan, blocks, tally.add)
    _warn_of_raised(tally.raised)
    return results


def _warn_of_raised(raised: Sequence[str]) -> None:
    if raised:
        warnings.warn(f"{counted(len(raised), 'point')} with the status RAISED: {raised[0]}", stacklevel=5)


def _into_file(
    plan: Plan, path: str | os.PathLike[str], overwrite: bool, threads: int | None, executor: Executor | None
) -> Results:
    from vibrodrive.batch.sweep import check_executor, check_threads
    from vibrodrive.jobs.sweep import Job, run
    from vibrodrive.model.size import refuse_large_block
    from vibrodrive.model.toml import as_toml
    from vibrodrive.store.layout import Origin
    from vibrodrive.store.load import check_path, load
    from vibrodrive.store.place import check_output

    file = check_path(path)
    for own in functions(plan.record):
        own.refuse_without_version()
    check_threads(threads)
    if executor is not None:
        check_executor(executor)
    check_output(file, None, overwrite=overwrite)
    refuse_large_block(plan, remote=executor is not None)
    job = Job(plan, Origin(as_toml(plan)), file, threads, overwrite=overwrite, executor=executor)
    raised = run(job, make_display(file.name))
    _warn_of_raised(raised)
    return load(file)
