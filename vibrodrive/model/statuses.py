"""Array of statuses: small integers that print as names."""

from typing import Any

import numpy as np

from vibrodrive.model.choices import Status

NO_STATUS = -128  # no version has such a status


class Statuses(np.ndarray):
    """int8 array with the status of each point. An element is a `Status`, and equals its name; results of NumPy's
    ufuncs are plain arrays. As texts the elements are names, `astype(str)`."""

    def __getitem__(self, index: Any) -> Any:
        element = super().__getitem__(index)
        return element if isinstance(element, np.ndarray) else as_status(int(element))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = (), **options: Any) -> Any:
        plain = [np.asarray(x) if isinstance(x, Statuses) else x for x in inputs]
        if ufunc in (np.equal, np.not_equal):
            plain = [_by_number(x) if np.asarray(x).dtype.kind == "U" else x for x in plain]
        if out:
            options["out"] = tuple(np.asarray(x) if isinstance(x, Statuses) else x for x in out)
        return getattr(ufunc, method)(*plain, **options)

    def astype(self, dtype: Any, *args: Any, **options: Any) -> Any:
        if np.dtype(dtype).kind not in "UO":
            return super().astype(dtype, *args, **options)
        names = [str(as_status(value)) for value in np.asarray(self).reshape(-1).tolist()]
        return np.array(names, dtype).reshape(self.shape)

    def __repr__(self) -> str:
        return f"Statuses({self})"

    def __format__(self, spec: str) -> str:
        return super().__format__(spec) if spec else str(self)

    def __str__(self) -> str:
        names = {"int": lambda value: str(as_status(int(value)))}
        return np.array2string(np.asarray(self), separator=", ", formatter=names)  # type: ignore[arg-type]


def _by_number(names: Any) -> np.ndarray:
    """Return names of statuses as int8 array; another text becomes NO_STATUS."""
    numbers = {status.name: int(status) for status in Status}
    return np.vectorize(lambda name: numbers.get(name.upper(), NO_STATUS), [np.int8])(names)


def as_status(value: int) -> Status | str:
    """Return the `Status` with the number `value`. If this version has no such status, return a text: "status 9"."""
    return Status(value) if value in Status.__members__.values() else f"status {value}"


def count_statuses(status: np.ndarray) -> dict[str, int]:
    """Return the number of points with each status, by the name of the status."""
    values, points = np.unique(np.asarray(status), return_counts=True)
    return {str(as_status(v)): n for v, n in zip(values.tolist(), points.tolist(), strict=True)}
