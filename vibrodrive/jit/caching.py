"""The cache of kernels on disk, with Numba's private classes (compiler.py).

This module uses private names of Numba, which may change. All are used at import, so that a missing name makes the
import fail; compiler.py then leaves the files of kernels to Numba.
"""

import hashlib
import os
import pickle
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace

from numba.core import externals
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys

from vibrodrive.jit.sources import PACKAGE


class _Place:
    """Place of the files of one kernel in the cache, an interface that Numba calls a locator.

    Numba would choose the place by the folder of the source, which archives and frozen programs do not have. If that
    place cannot be written, it would choose another, whose name does not contain the hash of the sources.
    """

    def __init__(self, folder, function, path):
        self._folder = folder
        self._function = function
        self._py_file = path

    def get_cache_path(self):
        return str(self._folder / self._function.__module__)

    def ensure_cache_path(self):
        os.makedirs(self.get_cache_path(), exist_ok=True)

    def get_disambiguator(self):
        return str(self._function.__code__.co_firstlineno)

    def get_source_stamp(self):
        """Return a hash of the source of a kernel outside the package. The folder has a hash of the package's own."""
        if self._function.__module__.startswith(f"{PACKAGE}."):
            return ""
        return hashlib.sha256(Path(self._py_file).read_bytes()).hexdigest()


class _Kernel(CompileResultCacheImpl):
    def __init__(self, folder, function):
        self._locator_classes = [SimpleNamespace(from_function=partial(_Place, folder))]
        super().__init__(function)


class _Files(IndexDataCacheFile):
    """Files of one kernel. Machine code is stored with its checksum, because damaged code would run, or crash."""

    def _save_data(self, name, data):
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(content + hashlib.sha256(content).digest())

    def _load_data(self, name):
        path = Path(self._data_path(name))
        content = path.read_bytes()
        if hashlib.sha256(content[:-32]).digest() != content[-32:]:
            raise ValueError(f"{path} is damaged")
        return pickle.loads(content)


class _Cache(FunctionCache):
    """Numba's cache on disk, read without Numba's compiler. A process that compiles nothing then takes half the time.

    Numba imports its compiler modules (0.2 s) before it reads a kernel. This class omits this import. Numba imports
    these modules anyway before it compiles a kernel. Errors of files end in a compilation, and not in an exception.
    """

    def __init__(self, function, folder, attempt):
        self._impl_class = partial(_Kernel, folder)
        super().__init__(function)
        self._attempt = attempt
        self._cache_file = _Files(self.cache_path, self._impl.filename_base, self._cache_file._source_stamp)

    def load_overload(self, sig, target_context):
        with self._attempt():
            try:
                rtsys.initialize(target_context)  # symbols that machine code may call: reference counts, libm
                externals.c_math_functions.install(target_context)
                return self._load_overload(sig, target_context)
            except Exception:
                with suppress(OSError):
                    self.flush()  # so that the kernel can be stored again
                raise

    def save_overload(self, sig, data):
        with self._attempt():
            self._save_overload(sig, data)


_private = (
    rtsys.initialize, externals.c_math_functions.install, Dispatcher.enable_caching, FunctionCache._load_overload,
    FunctionCache._save_overload, IndexDataCacheFile._load_data, IndexDataCacheFile._save_data,
    IndexDataCacheFile._open_for_write, IndexDataCacheFile._data_path, IndexDataCacheFile._dump,
)  # fmt: skip


def store(dispatcher, folder, attempt):
    """Let a kernel be stored in this folder. Errors of files are raised in the block of the context `attempt()`."""
    dispatcher._cache = _Cache(dispatcher.py_func, folder, attempt)
