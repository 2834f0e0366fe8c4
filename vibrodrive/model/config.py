"""Read and check a configuration file (TOML). docs/commands.md lists its tables and keys.

Each parameter is given once. An axis of a quantity of a scene replaces its entry of [physical]; A and B are then
computed for each point. An option of the command line replaces the value in the file, in any table. An option for the
method also removes `dtau` and `tol` of the file if this method does not use them.
"""

import os
import re
import stat
import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.choices import ACTS_ON
from vibrodrive.model.figure import (
    DIAGRAM_QUANTITIES,
    FIGURE_KINDS,
    FIGURE_UNITS,
    LOOK,
    MAP_QUANTITIES,
    STYLES,
    WIDTHS,
    check_curves,
    check_limits,
)
from vibrodrive.model.names import AXES, FURTHER, LINEAR, LOG, NAMES, PARAMETERS, SCENE, SCENE_AXES, SETTINGS
from vibrodrive.model.packaged import configurations
from vibrodrive.model.parameters import bad, check, check_count, has_control, missing, placed, unknown
from vibrodrive.model.physical import PACES
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.size import refuse_large
from vibrodrive.model.spacing import geometric
from vibrodrive.model.variables import POINT


def _in_table(table: str) -> tuple[str, ...]:
    """Return the names of the settings and parameters in a table of a configuration, settings first."""
    return tuple(name for name, row in (SETTINGS | PARAMETERS | FURTHER).items() if row.table == table)


HOMES: dict[str, tuple[str, ...]] = {
    "model": _in_table("model"),
    "sweep": (*AXES, "points"),
    "switching": _in_table("switching"),
    "run": _in_table("run"),
}
"""Tables with the arguments of a sweep, and the keys of each table. The axes are in [sweep]."""

MOST_BYTES = 1 << 25  # largest size of a configuration file: about two million numbers, which take ten seconds to read

DEEP_KEY = re.compile(r"(?:\.[ \t]{0,9}[\w\"'-]{1,99}[ \t]{0,9}){100}")
"""Pattern of a key with more than 100 parts. Such a key is refused, because the time to read a key grows as the square
of the number of its parts."""

COMMA = re.compile(r"[-+\d.,e\s\[\]]*,[-+\d.,e\s\[\]]*", re.IGNORECASE)
"""Pattern of numbers with a decimal comma, or of several numbers."""

ALONG = (*AXES, POINT)  # values of `x` and `y` in [figure]: names of axes


@dataclass(frozen=True)
class Config:
    """A checked configuration.

    text : contents of the file, verbatim.
    overrides : options KEY=VALUE that replaced values of the file.
    arguments : arguments of `plan.make_plan`, as they are written, with ranges as arrays.
    sweep : the plan of these arguments.
    figure, trajectory, orbits : checked values of the tables with these names, by key.
    """

    text: str
    overrides: tuple[str, ...]
    arguments: dict[str, Any]
    sweep: Plan
    title: str
    figure: dict[str, Any]
    trajectory: dict[str, Any]
    orbits: dict[str, Any]

    @property
    def look(self) -> dict[str, Any]:
        """Style of figures: `style` and `width`, if given."""
        return {key: self.figure[key] for key in LOOK if key in self.figure}

    def plan(self) -> Plan:
        """Return the sweep of this configuration."""
        return self.sweep


def read(path: Path, overrides: Sequence[str] = ()) -> Config:
    """Read and check a configuration file. Raises ConfigError with one line that names the file."""
    try:
        return parse(_text_of(Path(path)), overrides)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}{_meant(Path(path))}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: must be text in UTF-8, but byte {error.start} is invalid") from None
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def _meant(path: Path) -> str:
    """Return a hint for a file that is missing: one with the ending .toml, or a supplied one; or ""."""
    name = str(path).removesuffix(".toml")
    if path.exists():
        return ""
    if os.path.exists(f"{name}.toml"):
        return f". Did you mean {name}.toml?"
    return f"; `vibrodrive init {name}` writes {name}.toml" if (configurations() / f"{name}.toml").exists() else ""


def special(path: str | Path) -> str | None:
    """Return the type of a path that is not a regular file, such as "a named pipe"; None for a regular file.

    Opening such a path may block. Raises OSError if the path does not exist, or if the system refuses access.
    """
    mode = os.stat(path).st_mode
    kind = "a directory" if stat.S_ISDIR(mode) else "a named pipe" if stat.S_ISFIFO(mode) else "a device or socket"
    return None if stat.S_ISREG(mode) else kind


def _text_of(path: Path) -> str:
    # a pipe of the shell, <(…), has no path and can be read; a read of a named pipe would block until data are written
    if (kind := special(path)) and os.path.exists(os.path.realpath(path)):
        raise ConfigError(f"must be a configuration file, but is {kind}")
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if content.startswith(b"\x89HDF"):
        resumed = "to resume it, repeat the command or the call that made it"
        raise ConfigError(
            f"must be a configuration, but is a result file; `vibrodrive plot {path}` draws it; {resumed}"
        )
    if len(content) > MOST_BYTES:
        instead = "give a long axis as a range {start, stop, num}, or as an array to vd.sweep(..., path=…)"
        raise ConfigError(f"must be at most {MOST_BYTES >> 20} MiB; {instead}")
    return content.decode("utf-8-sig")  # some editors begin a file with a byte order mark


def parse(text: str, overrides: Sequence[str] = ()) -> Config:
    """Check a configuration given as text. Raises ConfigError."""
    if DEEP_KEY.search(text):
        raise ConfigError("invalid TOML: a key must have at most 100 parts")
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise ConfigError("invalid TOML: lists or tables are nested too deeply") from None
    except ValueError as error:
        why = error if isinstance(error, tomllib.TOMLDecodeError) else "an integer has too many digits"
        raise ConfigError(f"invalid TOML: {why}{_pointed(text, str(error))}") from None
    # Python makes surrogates of bytes that its locale does not know
    overrides = [option.encode("utf-8", "surrogateescape").decode("utf-8", "surrogateescape") for option in overrides]
    for option in sorted(overrides, key=lambda option: "method" not in option.partition("=")[0]):
        _override(tables, option)  # the method first, because it removes parameters of the file, not of other options
    try:
        return _checked(tables, text, tuple(overrides))
    except (TypeError, ValueError) as error:
        raise ConfigError(*error.args) from None


def _pointed(text: str, error: str) -> str:
    """Return a hint if the line of an error of TOML has a decimal comma."""
    at = re.search(r"at line (\d+)", error)
    comma = re.search(r"(?<![\w.,])[+-]?\d+,\d+(?![\w.]|,\d)", text.split("\n")[int(at[1]) - 1]) if at else None
    return f". Write {comma[0].replace(',', '.')} for {comma[0]}" if comma else ""


def _checked(tables: dict[str, Any], text: str, overrides: tuple[str, ...]) -> Config:
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise TypeError(bad("title", title, "a string"))
    if has_control(title) or title != title.encode(errors="replace").decode():  # an option may have other bytes
        raise ValueError(bad("title", title, "one line, without control characters"))
    for name, table in tables.items():
        if name not in TABLES:
            raise ValueError(unknown("table", name, ["title", *TABLES]) + _belongs(name))
        if not isinstance(table, dict):
            raise TypeError(bad(name, table, f"a table [{name}]"))
        for key in table:
            if key not in TABLES[name]:
                raise ValueError(unknown(f"key of [{name}]", key, TABLES[name]) + _belongs(key))

    arguments: dict[str, Any] = {}
    scene = _given_by_scene(tables)
    at = dict.fromkeys(scene, "physical")

    def place(key: str) -> str:
        table = at.get(key, "physical" if key in SCENE else "")
        return f"{table}.{key}" if table in ("sweep", "sweep.points", "physical") else key

    with placed(place):
        for name in (*HOMES, "physical"):
            for key, value in tables.get(name, {}).items():
                if name != "physical" and key in at:
                    raise ValueError(bad(f"{name}.{key}", value, f"left out, because [{at[key]}] already gives {key}"))
                at[key] = name
                arguments[key] = _argument(name, key, value, at)
        plan = make_plan(arguments)
    extras = {name: {k: _extra(name, k, v) for k, v in tables.get(name, {}).items()} for name in _EXTRAS}
    return Config(text, overrides, arguments, plan, title, **extras)


def _belongs(key: str) -> str:
    """Return the tables that have a key as a sentence, "" for a key of no table."""
    tables = [f"[{name}]" for name, keys in TABLES.items() if key in keys]
    return f". It is a key of {' or '.join(tables)}" if tables else ""


def _argument(table: str, key: str, value: Any, at: dict[str, str]) -> Any:
    """Return an argument of a sweep, as `make_plan` takes it. Add keys of [sweep.points] to `at`, which gives the table
    of each key."""
    if key == "points":
        return _points(value, at)
    if table == "sweep":
        return _axis(key, value, "sweep")
    if isinstance(value, list | dict) and key in (*PARAMETERS, *SCENE):
        raise TypeError(bad(key, value, NAMES[key].allowed))
    return value


def _given_by_scene(tables: Mapping[str, Any]) -> list[str]:
    """Return the keys that only the scene may give: its own keys, B, and A if the scene gives a0."""
    sweep = tables.get("sweep", {})
    points = sweep.get("points", ())
    varied = {*sweep, *(points if isinstance(points, dict) else ())}
    scene = {*tables.get("physical", {}), *(SCENE_AXES.keys() & varied)}
    if not scene and "physical" not in tables:
        return []
    return [*tables.get("physical", {}), "B", *(["A"] if "a0" in scene else [])]


def _axis(key: str, value: object, table: str) -> Any:
    return _range(key, value, f"{table}.{key}") if isinstance(value, dict) else value


def _points(table: object, at: dict[str, str]) -> dict[str, Any]:
    """Return the values in [sweep.points] by key, which `make_plan` checks, and add the keys to `at`.

    Raises TypeError if it is no table, and ValueError if `at` already contains one of the keys.
    """
    if not isinstance(table, dict):
        raise TypeError(bad("sweep.points", table, "a table [sweep.points]"))
    for key, value in table.items():
        if key in at:
            raise ValueError(bad(f"sweep.points.{key}", value, f"left out, because [{at[key]}] already gives {key}"))
        at[key] = "sweep.points"
    return {key: _axis(key, value, "sweep.points") for key, value in table.items()}


def _range(key: str, table: Mapping[str, Any], place: str) -> np.ndarray:
    keys = ("start", "stop", "num", "scale")
    for k in table:
        if k == "step":
            raise ValueError(bad(f"{place}.step", table[k], f"replaced by num, the number of values{_counted(table)}"))
        if k not in keys:
            raise ValueError(unknown(f"key of {place}", k, keys))
    for k in keys[:3]:
        if k not in table:
            raise ValueError(missing(f"{place}.{k}", ", because a range needs start, stop and num"))
    start, stop = (check(key, table[k], f".{k}") for k in ("start", "stop"))
    num = check_count(f"{place}.num", table["num"], 1)
    scale = table.get("scale", LINEAR)
    if scale not in (LINEAR, LOG):
        raise ValueError(bad(f"{place}.scale", scale, f"one of {LINEAR}, {LOG}"))
    if num == 1 and start != stop:
        allowed = f">= 2, because a range contains both of its ends (one value is written as {key} = {start!r})"
        raise ValueError(bad(f"{place}.num", num, allowed))
    refuse_large(f"{place}.num = {num}", "its values and their copies take", 4 * 8 * num)
    if scale == LINEAR:
        return np.linspace(start, stop, num)
    for k, end in (("start", start), ("stop", stop)):
        if end <= 0:
            raise ValueError(bad(f"{place}.{k}", end, 'a number > 0 with scale = "log"'))
    return geometric(start, stop, num)


def _counted(table: Mapping[str, Any]) -> str:
    """Return the number of values of {start, stop, step}, as ", here 26", "" if they do not give a whole number."""
    try:
        steps = (table["stop"] - table["start"]) / table["step"]
        return f", here {steps + 1:.0f}" if 0 < steps < 1e9 and abs(steps - round(steps)) < 1e-6 else ""
    except (KeyError, TypeError, ArithmeticError):
        return ""


def _count(key: str, value: object) -> int:
    return check_count(key, value, 1)


_EXTRAS: dict[str, dict[str, tuple[str, ...] | Callable[[str, Any], Any]]] = {
    "figure": {
        "kind": FIGURE_KINDS,
        "quantity": (*DIAGRAM_QUANTITIES, *MAP_QUANTITIES),
        "x": ALONG,
        "y": ALONG,
        "limits": check_limits,
        "style": STYLES,
        "width": WIDTHS,
        "units": FIGURE_UNITS,
    },
    "trajectory": {"periods": _count, "curves": check_curves},
    "orbits": {"max_period": _count},
}
"""Tables of single commands: for each key its allowed values, or a function that checks a value and returns it."""


def _extra(table: str, key: str, value: Any) -> Any:
    allowed, place = _EXTRAS[table][key], f"{table}.{key}"
    if callable(allowed):
        return allowed(place, value)
    if value not in allowed:
        raise ValueError(unknown(place, value, allowed))
    return value


def _override(tables: dict[str, Any], option: str) -> None:
    """Store the value of one option KEY=VALUE of `--set` in the tables read from a file."""
    key, equals, written = option.partition("=")
    path = key.strip().split(".")
    if not equals or not all(path):
        raise ConfigError(bad("--set", option, "KEY=VALUE or TABLE.KEY=VALUE"))
    try:
        value = tomllib.loads(f"value = {written.strip()}")
    except ValueError:
        value = {"value": _bare(key.strip(), written.strip())}
    if set(value) != {"value"}:
        raise ConfigError(bad("--set", option, "one KEY=VALUE"))
    if path[0] not in TABLES and path != ["title"]:
        path = [_home(tables, path[0], value["value"]), *path]
    if len(path) > 1 and path[0] in (*HOMES, "physical"):
        _take_out(tables, path[0], path[1])
    table = tables
    for name in path[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            raise ConfigError(bad("--set", option, f"a key of a table, but {name} is not a table"))
    if path[-1] in TABLES and len(path) == 1:
        raise ConfigError(bad("--set", option, "TABLE.KEY=VALUE"))
    table[path[-1]] = value["value"]
    if path[-1] == "method":
        _leave_out_idle(table)


def _bare(key: str, word: str) -> str | float:
    """Return the value of an option that is no TOML: a bare word, as in method=fixed, or half a number, as in .5."""
    if COMMA.fullmatch(word) and key != "title":
        raise ConfigError(bad(key, word, f"a number with a decimal point, or a list such as {key}=[0.5, 1]"))
    try:
        return float(word) if "." in word else word
    except ValueError:
        return word


def _take_out(tables: Mapping[str, Any], home: str, key: str) -> None:
    """Remove a key from all tables but its new home. A key, and the frequency of a scene, may be in one table only."""
    keys = PACES if key in PACES else {key}
    for name in (*HOMES, "physical"):
        if isinstance(tables.get(name), dict):
            for other in keys if name != home else keys - {key}:
                tables[name].pop(other, None)


def _leave_out_idle(switching: dict[str, Any]) -> None:
    """Remove the parameters of a file that were meant for its own method."""
    for key, methods in ACTS_ON.items():
        if str(switching["method"]).upper() not in [method.name for method in methods]:
            switching.pop(key, None)


TABLES: dict[str, Collection[str]] = {"model": HOMES["model"], "physical": SCENE, **HOMES, **_EXTRAS}


def _home(tables: Mapping[str, Any], key: str, value: object) -> str:
    """Return the table of a key that is given without a table.

    An axis belongs to [sweep]. Any other key belongs to the table of the file that contains the key, or else to the
    first table that may contain the key.
    """
    if key in HOMES["sweep"] and isinstance(value, (list, dict)):
        return "sweep"
    for name in TABLES:
        if isinstance(tables.get(name), dict) and key in tables[name]:
            return name
    homes: dict[str, str] = {}
    for name, keys in TABLES.items():
        homes |= {k: name for k in keys if name != "sweep" and k not in homes}
    if key not in homes:
        raise ConfigError(unknown("key of --set", key, homes))
    return homes[key]
