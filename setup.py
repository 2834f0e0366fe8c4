"""Wheels with the machine code of all kernels: `VIBRODRIVE_KERNELS=1 python -m build --wheel` (RELEASING.md).

Without this variable, a wheel contains no machine code, and nothing is compiled when it is built.
"""

import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from shutil import which

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

TAG = "py3", "none", "manylinux_2_17_x86_64"  # the code calls five functions of any version of glibc, and no Python


WANTED = os.environ.get("VIBRODRIVE_KERNELS") == "1"


class BuildWithKernels(build_py):
    """Add the machine code to the package if it is wanted, and leave out that of an earlier build."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        package = Path(self.build_lib).resolve()
        for path in (package / "vibrodrive" / "shipped").glob("*"):
            if path.suffix in (".so", ".json"):
                path.unlink()
        if WANTED:
            found = os.pathsep.join(filter(None, (str(package), os.environ.get("PYTHONPATH"))))
            environment = os.environ | {"PYTHONPATH": found, "PYTHONDONTWRITEBYTECODE": "1"}
            subprocess.run([sys.executable, "-m", "vibrodrive.shipped.build"], cwd=package, env=environment, check=True)


def for_an_index(readme: str) -> str:
    """Return a page that needs no other file: without pictures and their captions, and of links the words alone."""
    shown = re.sub(r"^!\[[^\]]*\]\([^)]*\)\n\n(?:\*(?!\*).*?\*\n\n)?", "", readme, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", shown)


class WheelWithKernels(bdist_wheel):
    """Name the platform, for which alone the machine code is."""

    def finalize_options(self) -> None:
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self) -> tuple[str, str, str]:
        return TAG


page = {
    "long_description": for_an_index((Path(__file__).parent / "README.md").read_text(encoding="utf-8")),
    "long_description_content_type": "text/markdown",
}
if WANTED:
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        raise SystemExit("VIBRODRIVE_KERNELS=1: must be built on Linux on x86-64; leave it out on other systems")
    os.environ.setdefault("SOURCE_DATE_EPOCH", "315532800")  # the first day of zip: two builds have the same bytes
    linker = [] if any(map(which, ("cc", "gcc", "clang"))) else ["ziglang"]
    setup(
        **page,
        cmdclass={"build_py": BuildWithKernels, "bdist_wheel": WheelWithKernels},
        setup_requires=["numba>=0.60", *linker],
    )
else:
    setup(**page, cmdclass={"build_py": BuildWithKernels})
