"""The available memory is the least that the machine, control groups and limits of the process leave.

The files of the system are those that Docker, Kubernetes, Slurm and systemd show in a process.
"""

import shutil

import numpy as np
import pytest

from vibrodrive.errors import TooLarge
from vibrodrive.model import size
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results

MB = 10**6
FREE = 24_000 * MB

V1, V2 = "cgroup cgroup rw,memory", "cgroup2 cgroup2 rw,nsdelegate"

GROUPS = {
    "container": ("/ /cg", V2, "0::/", {"": {"max": 700, "current": 300}}, 400),
    "cached files": ("/ /cg", V2, "0::/", {"": {"max": 700, "current": 600, "files": (150, 50)}}, 300),
    "no limit": ("/ /cg", V2, "0::/", {"": {"max": "max", "current": 300}}, FREE // MB),
    "above its limit": ("/ /cg", V2, "0::/", {"": {"max": 700, "current": 701}}, 0),
    "throttled": ("/ /cg", V2, "0::/app", {"app": {"max": 900, "high": 700, "current": 300}}, 400),
    "job above the step": ("/ /cg", V2, "0::/slurm/job_1/step_0", {
        "slurm/job_1/step_0": {"max": "max", "current": 100}, "slurm/job_1": {"max": 700, "current": 600},
        "slurm": {"max": 9000, "current": 650},
    }, 100),
    "step below the job": ("/ /cg", V2, "0::/slurm/job_1/step_0", {
        "slurm/job_1/step_0": {"max": 200, "current": 150}, "slurm/job_1": {"max": 700, "current": 600},
    }, 50),
    "version 1": ("/ /cg", V1, "5:cpu,memory:/slurm/job_1", {"slurm/job_1": {"max": 700, "current": 600}}, 100),
    "version 1, files": ("/ /cg", V1, "5:memory:/a", {"a": {"max": 700, "current": 600, "files": (80, 20)}}, 200),
    "version 1, container": ("/docker/ab /cg", V1, "5:memory:/docker/ab", {"": {"max": 700, "current": 600}}, 100),
    "version 1, part of a container": ("/docker/ab /cg", V1, "5:memory:/docker/ab/c", {
        "c": {"max": 300, "current": 250}, "": {"max": 700, "current": 600}
    }, 50),
    "version 1, no limit": ("/ /cg", V1, "5:memory:/", {"": {"max": 2**63 // MB, "current": 600}}, FREE // MB),
    "group outside of the mounted groups": ("/ /cg", V2, "0::/../other", {"": {"max": 700, "current": 300}}, 400),
    "group of another name": ("/docker/ab /cg", V1, "5:memory:/docker/abc", {"": {"max": 700, "current": 300}}, 400),
    "another controller": ("/ /cg", "cgroup cgroup rw,cpu", "5:cpu:/", {"": {"max": 7, "current": 3}}, FREE // MB),
}  # fmt: skip
"""By name: root and mount point, type and options of the mount, the group of the process, the sizes of groups in MB,
and the available memory in MB."""


@pytest.fixture
def system(tmp_path, monkeypatch):
    """Return a function that writes a file of the system."""

    def write(path, *lines):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("".join(f"{line}\n" for line in lines))

    write("proc/meminfo", "MemTotal:  99999999 kB", "MemFree:  1 kB", f"MemAvailable:   {FREE // 1024} kB")
    monkeypatch.setattr(size, "SYSTEM", tmp_path)
    return write


def mount(system, place, kind, group, sizes):
    system("proc/self/cgroup", "9:name=systemd:/elsewhere", "2:cpuset:/elsewhere", group)
    system("proc/self/mountinfo", "24 1 8:1 / / rw - ext4 /dev/sda rw", f"31 24 0:28 {place} rw - {kind}")
    names = {"max": "memory.limit_in_bytes", "current": "memory.usage_in_bytes"} if kind == V1 else {}
    for name, numbers in sizes.items():
        for key, value in numbers.items():
            if key == "files":
                prefix = "total_" if kind == V1 else ""
                lines = [
                    f"{prefix}{age}_file {part * MB}" for age, part in zip(("active", "inactive"), value, strict=True)
                ]
                system(f"cg/{name}/memory.stat", "anon 1", "active_file 3", "inactive_file 4", *lines)
            else:
                system(f"cg/{name}/{names.get(key, f'memory.{key}')}", value if value == "max" else value * MB)


@pytest.mark.parametrize("name", GROUPS)
def test_least_memory_of_all_groups_is_available(system, name):
    *files, left = GROUPS[name]
    mount(system, *files)
    assert size.available_memory() // MB == left


def test_both_versions_of_groups_are_respected(system):
    mount(system, *GROUPS["version 1"][:-1])
    system("proc/self/mountinfo", f"31 24 0:28 / /cg rw shared:9 - {V1}", f"41 31 0:38 / /cg/unified rw - {V2}")
    assert size.available_memory() == 100 * MB
    system("cg/unified/memory.max", 50 * MB)
    assert size.available_memory() == 50 * MB


@pytest.mark.parametrize(("limit", "used"), [("RLIMIT_AS", "VmSize"), ("RLIMIT_DATA", "VmData")])
def test_limits_of_the_shell_are_respected(system, monkeypatch, limit, used):
    import resource

    limits = {getattr(resource, limit): (700 * MB, 900 * MB)}
    monkeypatch.setattr(resource, "getrlimit", lambda which: limits.get(which, (resource.RLIM_INFINITY,) * 2))
    system("proc/self/status", "Name:\tpython", f"{used}:\t  {100_000} kB")
    assert size.available_memory() == 700 * MB - 100_000 * 1024


def test_results_larger_than_the_container_are_refused(system):
    mount(system, *GROUPS["container"][:-1])
    Results.uncomputed(make_plan({"A": np.linspace(3, 3.25, 100), "transient": 10, "periods": 20_000}))
    for points, periods in ((4000, 20_000), (1200, 20_000)):  # the second: 384 MB of 400 MB
        plan = make_plan({"A": np.linspace(3, 3.25, points), "transient": 10, "periods": periods})
        with pytest.raises(TooLarge, match=r"the results take .*, and 332\.9 MB are available"):
            Results.uncomputed(plan)


def test_free_space_is_that_of_the_disk_to_which_a_link_leads(tmp_path, monkeypatch):
    (tmp_path / "other").mkdir()
    (tmp_path / "link.h5").symlink_to(tmp_path / "other" / "target.h5")
    asked = []
    monkeypatch.setattr(shutil, "disk_usage", lambda p: asked.append(p) or shutil._ntuple_diskusage(9, 9, 9))
    with pytest.raises(TooLarge, match=r"the file takes .*, and 9 B are free"):
        size.refuse_large_file(make_plan({"A": [3.0], "transient": 10, "periods": 10}), tmp_path / "link.h5")
    assert asked == [str(tmp_path / "other")]
    monkeypatch.undo()
    monkeypatch.setattr(size, "_limit", lambda name: 5000 if name == "RLIMIT_FSIZE" else None)
    with pytest.raises(TooLarge, match=r"must be small enough for the file size limit; .*, and 5\.0 kB are allowed"):
        size.refuse_large_file(make_plan({"A": [3.0], "transient": 10, "periods": 10}), tmp_path / "x.h5")
