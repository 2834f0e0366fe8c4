"""Make the machine code of all kernels: a library for each kind of processor, and the table of the kernels in it.

`python build_kernels.py FOLDER` compiles each kernel with Numba for each kind of processor, takes Numba's
optimised LLVM module, keeps of it what the kernel calls, and links all into one library. Without FOLDER the files get
into the package, where they are used until a kernel is edited. It needs the package on the path, and the linker of a
compiler of C. The result depends on the sources and on the versions of Numba and LLVM, and on nothing else.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from shutil import which
from typing import Any

from vibrodrive.jit.compile import Kernel, Marked
from vibrodrive.jit.shipped import FOLDER, LEVELS, TABLE, sum_of
from vibrodrive.jit.sources import fingerprints

MODULES = (
    "kernels.sampling", "kernels.single", "periodic.fixed_points", "stability.impulses", "stability.reach",
    "explorer.density",
)  # fmt: skip
"""Modules whose kernels, and those of the modules that they import, are made. `kernels` adds those of factories."""

FEATURES = {
    "x86-64-v3": "+avx,+avx2,+bmi,+bmi2,+f16c,+fma,+lzcnt,+movbe,+xsave",
    "x86-64-v4": "+avx,+avx2,+bmi,+bmi2,+f16c,+fma,+lzcnt,+movbe,+xsave,"
    "+avx512f,+avx512bw,+avx512cd,+avx512dq,+avx512vl",
}
"""LLVM's names of the features in `LEVELS`"""


def kernels() -> Iterator[Kernel]:
    """Yield all kernels, in an order that does not change."""
    from vibrodrive.kernels.engine import batch
    from vibrodrive.kernels.single import single
    from vibrodrive.model.choices import Method

    for name in MODULES:
        import_module(f"vibrodrive.{name}")
    for name in sorted(name for name in sys.modules if name.startswith("vibrodrive.")):
        for value in vars(sys.modules[name]).values():
            if isinstance(value, Kernel) and value.like is not None and value.__module__ == name:
                yield value
    for method in map(int, Method):  # as in `Settings`: the cache distinguishes the types of numbers in a closure
        for recorded in (False, True):
            for disturbed in (False, True):
                yield batch(method, disturbed, recorded)
            if method != Method.FIXED:
                yield single(method, recorded, True)
    yield single(Method.FIXED, False, False)


def _kind(given: Any) -> Any:
    """Return a type of Numba as the table describes it (`jit/shipped.py`)."""
    from numba.core import types
    from numba.np.numpy_support import as_dtype

    if isinstance(given, types.Array):
        dtype = as_dtype(given.dtype)
        return {"dtype": dtype.str if dtype.names is None else dtype.descr, "ndim": given.ndim}
    numbers = {types.int64: "i8", types.uint64: "u8", types.float64: "f8", types.boolean: "b1", types.none: None}
    if types.unliteral(given) in numbers:
        return numbers[types.unliteral(given)]
    return [_kind(each) for each in given]  # a tuple


def _entry(compiled: Any, context: Any, name: str) -> Any:
    """Return an LLVM module with one function, which calls a kernel as `jit/shipped.py` describes it."""
    from llvmlite import binding, ir
    from numba.core import types

    word, module = ir.IntType(64), ir.Module()
    described = compiled.fndesc
    kernel_type = context.call_conv.get_function_type(described.restype, described.argtypes)
    kernel = ir.Function(module, kernel_type, described.llvm_func_name)
    entry = ir.Function(module, ir.FunctionType(ir.VoidType(), [word.as_pointer()]), name)
    builder, numbers, flat = ir.IRBuilder(entry.append_basic_block()), count(), []

    def load() -> Any:
        return builder.load(builder.gep(entry.args[0], [word(next(numbers))]))

    def add(kind: Any) -> None:
        if isinstance(kind, types.Array):
            address, shape = load(), [load() for _ in range(kind.ndim)]
            sizes = [word(context.get_abi_sizeof(context.get_data_type(kind.dtype)))]
            for length in reversed(shape):
                sizes.insert(0, builder.mul(sizes[0], length))
            elements = builder.udiv(sizes[0], sizes[-1])
            flat.extend([word(0), word(0), elements, sizes[-1], address, *shape, *sizes[1:]])  # no owner
        elif isinstance(kind, types.Number | types.Boolean):
            flat.append(load())
        else:  # a tuple
            for each in kind:
                add(each)

    for kind in described.argtypes:
        add(kind)
    out, exception, *parameters = kernel.args
    arguments = [_as(builder, value, each.type) for value, each in zip(flat, parameters, strict=True)]
    pointers = [builder.bitcast(entry.args[0], each.type) for each in (out, exception)]  # no kernel raises an exception
    builder.call(kernel, [*pointers, *arguments])
    builder.ret_void()
    return binding.parse_assembly(str(module))


def _as(builder: Any, word: Any, kind: Any) -> Any:
    """Return a word as a value of an LLVM type: an address, a float or an integer."""
    from llvmlite import ir

    if isinstance(kind, ir.PointerType):
        return builder.inttoptr(word, kind)
    return builder.bitcast(word, kind) if isinstance(kind, ir.DoubleType) else builder.trunc(word, kind)


def _object(module: Any, entry: Any, name: str, machine: Any) -> bytes:
    """Return machine code of the function `name` of the LLVM module `entry`, with all that it calls in `module`."""
    from llvmlite import binding

    module = binding.parse_bitcode(module.as_bitcode())
    module.link_in(entry)
    for each in (*module.functions, *module.global_variables):
        if not each.is_declaration and each.name != name:
            each.linkage = "internal"
    passes = binding.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    passes.run(module, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options(speed_level=0)))
    return machine.emit_object(module)


def _linker() -> list[str]:
    """Return the command of a compiler of C, which links. Raises FileNotFoundError if there is none."""
    for command in (os.environ.get("CC", "cc"), "gcc", "clang"):
        if which(command):
            return [command]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise FileNotFoundError("no compiler of C was found to link the kernels: install gcc, or the package ziglang")


def _marked() -> Iterator[Marked]:
    """Yield the functions that kernels call, of all modules that are imported."""
    for name in sorted(name for name in sys.modules if name.startswith("vibrodrive.")):
        yield from (value for value in vars(sys.modules[name]).values() if isinstance(value, Marked))


def _without_folder(marked: Marked) -> None:
    """Let the code of a function name its module as its file. Numba writes this name into exceptions."""
    code = marked.py_func.__code__
    marked.py_func.__code__ = code.replace(co_filename=marked.__module__)


def make_library(level: str, folder: Path, kernels: Iterable[Kernel]) -> dict[str, Any]:
    """Make the library for one kind of processor in `folder`, and return the table of its kernels.

    Numba must have been told, by variables, to compile for these processors.
    """
    from llvmlite import binding

    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    target = binding.Target.from_triple(binding.get_process_triple())
    machine = target.create_target_machine(cpu=level, features=FEATURES[level], opt=3, reloc="pic", codemodel="small")
    table, objects = {}, []
    with tempfile.TemporaryDirectory() as scratch:
        for number, kernel in enumerate(kernels):
            for each in (kernel, *_marked()):
                _without_folder(each)
            kernel.prepare()
            (compiled,) = kernel.dispatcher.overloads.values()
            symbol = f"kernel{number}"
            signature = compiled.signature
            table[kernel.name] = symbol, [_kind(each) for each in signature.args], _kind(signature.return_type)
            entry = _entry(compiled, kernel.dispatcher.targetctx, symbol)
            code = _object(compiled.library._final_module, entry, symbol, machine)
            objects.append(Path(scratch) / f"{symbol}.o")
            objects[-1].write_bytes(code)
        options = ["-shared", "-nostdlib", "-Wl,--build-id=none", "-Wl,--strip-all", "-Wl,-z,noexecstack"]
        subprocess.run([*_linker(), *options, "-o", folder / f"{level}.so", *objects], check=True)
    if str(FOLDER.parent).encode() in (folder / f"{level}.so").read_bytes():
        raise RuntimeError(f"the library for {level} contains the name of the folder in which it was made")
    return table


def _make_apart(level: str, folder: Path, cache: str) -> Any:
    """Return the result of `make_library` in a process of its own, whose Numba compiles for this kind of processor."""
    others = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    settings = {
        "NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": FEATURES[level], "NUMBA_CACHE_DIR": cache,
        "PYTHONHASHSEED": "0", "VIBRODRIVE_CODE": "numba", "PYTHONPATH": os.pathsep.join(sys.path),
    }  # fmt: skip
    command = [sys.executable, "-P", __file__, str(folder), level]
    done = subprocess.run(command, check=True, env=others | settings, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout)


def make(folder: Path) -> None:
    """Make the libraries for all kinds of processors, and the table, in `folder`."""
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor() as pool:
        tables = list(pool.map(lambda level: _make_apart(level, folder, scratch), LEVELS))
    if tables[0] != tables[1]:
        raise RuntimeError("the kernels for two kinds of processors have different signatures")
    write_table(folder, tables[0])


def write_table(folder: Path, kernels: dict[str, Any]) -> None:
    """Write the table of the kernels in the libraries in `folder`."""
    sums = {path.stem: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("*.so"))}
    content = {"sources": fingerprints()[1], "libraries": sums, "kernels": kernels, "sum": sum_of(kernels)}
    (folder / TABLE).write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        print(json.dumps(make_library(sys.argv[2], Path(sys.argv[1]), kernels())))
    else:
        make(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
