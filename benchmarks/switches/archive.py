"""Write the set as one archive for a release: `python -m benchmarks.switches.archive` writes switches-VERSION.tar.gz.

The archive contains the cases, their tables, the scorer and the state machine, which need Python only. Two runs write
the same bytes.
"""

import argparse
import gzip
import io
import tarfile
from pathlib import Path

HERE = Path(__file__).parent
FILES = ("VERSION", "LICENSE", "README.md", "schema.json", "score.py", "machine.py", "*.csv", "cases/**/*.json")


def write(path: Path) -> None:
    """Write the archive."""
    root = path.name.removesuffix(".tar.gz")
    files = sorted(file for pattern in FILES for file in HERE.glob(pattern))
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as tar:
        for file in files:
            content, entry = file.read_bytes(), tarfile.TarInfo(f"{root}/{file.relative_to(HERE).as_posix()}")
            entry.size = len(content)
            tar.addfile(entry, io.BytesIO(content))
    path.write_bytes(gzip.compress(packed.getvalue(), mtime=0))


def main() -> None:
    version = (HERE / "VERSION").read_text(encoding="utf-8").strip()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(f"switches-{version}.tar.gz"))
    write(parser.parse_args().output)


if __name__ == "__main__":
    main()
