"""Compiles kernels: numba's njit, whose cache finds a place on every machine.

numba caches compiled kernels beside their files or in the user's cache folder. In a container neither may be writable,
and numba then refuses to compile. The cache goes to a temporary folder of the user in that case, or is left out. numba
looks at the file of a kernel alone; here, a change of its options, of this module or of what it imports makes it
compile anew, too.

Seven things save compilation time. What other kernels call, numba's own functions included, is compiled without the
wrappers for calls from Python, and LLVM optimises it within its callers only. Constants in such a call are no types of
their own. numba's answers to what type `a + b` has are remembered. `a[i, j]` needs fewer instructions than numba's.
Values of a tuple that was just made are not read back. What holds no variable is not searched for variables. Python
collects no garbage meanwhile. Results are the same to the last bit. The changes of numba hold for the whole process.
"""

from __future__ import annotations

import gc
import hashlib
import os
import stat
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import cache, partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numba.core import cgutils, codegen, compiler, event, ir, targetconfig, types
from numba.core.typing import templates
from numba.np import arrayobj

config: Any = numba.config
unliteral: Any = types.unliteral
register: Any = event.register
function_type: Any = types.BaseFunction
overload: Any = templates._OverloadFunctionTemplate
compilation_flags: Any = targetconfig.ConfigStack
numba_arrays: Any = arrayobj
numba_ir: Any = ir
numba_codegen: Any = codegen
numba_compiler: Any = compiler
llvm: Any = numba_codegen.llvmir
item_pointer: Any = cgutils.get_item_pointer2
JITCodeLibrary: Any = codegen.JITCodeLibrary
Compiler: Any = compiler.Compiler
OWN = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
NO_CACHE = (
    "kernels are compiled anew in every process: their cache has no place, because neither the installation nor the "
    "home folder nor the temporary folder can be written; set NUMBA_CACHE_DIR to a folder that can"
)


def cached_njit(shared: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Returns a decorator: numba's njit, whose cache goes to the first place that can be written.

    x / 0 is inf or nan, x // 0 of whole numbers is 0.

    shared: the kernel is called from Python and from kernels with the same types, so that one form serves both.
    """

    options["no_cfunc_wrapper"] = True  # it serves kernels that are arguments of others
    options["error_model"] = "numpy"  # one for all: what np.empty and others compile to depends on it

    def compiled(function: Any) -> Any:
        if not options.get("cache"):
            return numba.njit(**options)(function)
        if not config.CACHE_DIR and not _numba_finds_a_place(os.path.dirname(function.__code__.co_filename)):
            config.CACHE_DIR = temporary_cache() or ""
        try:
            kernel = numba.njit(**options)(function)
        except RuntimeError as error:
            if "cannot cache function" not in str(error):
                raise
            _warn_once()
            return numba.njit(**{**options, "cache": False})(function)
        stored = _stored(kernel)
        stored._source_stamp = (stored._source_stamp, _used_by(function), OWN, repr(sorted(options.items())))
        _call_by_kernels(kernel, kernel if shared else numba.njit(**{**options, "cache": False, **INNER})(function))
        return kernel

    return compiled


def _call_by_kernels(kernel: Any, inner: Any) -> None:
    """Makes other kernels call `inner`, a form of `kernel` without the wrapper for calls from Python and without cache.

    A form of the kernel that exists already is used instead.
    """
    own_template, own_overload = kernel.get_call_template, kernel.get_overload

    def get_call_template(arguments: Any, named: Any) -> Any:
        plain = tuple(unliteral(a) for a in kernel.fold_argument_types(arguments, named)[1])
        template = own_template if inner is kernel or plain in kernel.overloads else inner.get_call_template
        return template(plain, {})

    def get_overload(arguments: Any) -> Any:
        return (own_overload if tuple(arguments) in kernel.overloads else inner.get_overload)(arguments)

    kernel.get_call_template, kernel.get_overload = get_call_template, get_overload


class _InnerCode(JITCodeLibrary):  # type: ignore[misc]
    """LLVM code that others link. It has no machine code, and is optimised in what links it."""

    codegen = property(lambda self: self)

    def set_env(self, name: str, env: Any) -> None:
        """Does nothing: only the wrappers for calls from Python use env."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _InnerCompiler(Compiler):  # type: ignore[misc]
    def define_pipelines(self) -> Any:
        self.state.library = _InnerCode(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _InnerCompiler}
_jit_of_overloads, _compile_internal = overload._get_jit_decorator, numba_compiler.compile_internal
overload._get_jit_decorator = lambda self: partial(_jit_of_overloads(self), **INNER)  # such as np.empty


def _for_all_callers(find: Any) -> Any:
    """Returns numba's _get_impl, which compiles a function once for kernels with and without a wrapper for Python."""

    @wraps(find)
    def _get_impl(self: Any, args: Any, kws: Any) -> Any:
        flags = compilation_flags.top_or_none()
        if flags is None or flags.no_cpython_wrapper:
            return find(self, args, kws)
        flags = flags.copy()
        flags.no_cpython_wrapper = True
        with compilation_flags().enter(flags):
            return find(self, args, kws)

    return _get_impl


overload._get_impl = _for_all_callers(overload._get_impl)


def _compile_part(typing: Any, target: Any, library: Any, *rest: Any, **named: Any) -> Any:
    return _compile_internal(typing, target, _InnerCode(target.codegen(), library.name), *rest, **named)


numba_compiler.compile_internal = _compile_part


def _with_memory(resolve: Any) -> Any:
    """Returns numba's BaseFunction.get_call_type with a memory, and a short way for numbers.

    It asks some thirty templates, each time anew, what type `a + b` has. Of numbers, those with lists of types know it.
    Only answers about operators are remembered: those of numbers do not change, whatever the options of the kernel.
    """
    known: dict[Any, Any] = {}

    def answer(self: Any, context: Any, args: Any, kws: Any) -> Any:
        plain = tuple(unliteral(a) for a in args)
        if all(isinstance(a, types.Number | types.Boolean) for a in plain):
            for template in (t(context) for t in self.templates if issubclass(t, templates.ConcreteTemplate)):
                signature = template.apply(plain, kws)
                if signature is not None:
                    return signature, template.get_impl_key(signature)
        signature = resolve(self, context, args, kws)
        return signature, self._impl_keys[signature.args]

    @wraps(resolve)
    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if getattr(self.typing_key, "__module__", "") != "_operator":
            return resolve(self, context, args, kws)
        call = self, context, tuple(args), tuple(dict(kws).items())
        if call not in known:
            known[call] = answer(self, context, args, kws)
        signature, implementation = known[call]
        self._impl_keys[signature.args] = implementation
        return signature

    return get_call_type


function_type.get_call_type = _with_memory(function_type.get_call_type)


def _with_short_way(indexing: Any) -> Any:
    """Returns numba's basic_indexing with a short way to one element.

    numba's own way takes each length of the array apart twice, and the steps that an array in rows does not need.
    """

    @wraps(indexing)
    def basic_indexing(
        context: Any, builder: Any, kind: Any, array: Any, index_types: Any, indices: Any, boundscheck: Any = None
    ) -> Any:
        if boundscheck or len(indices) != kind.ndim or not all(isinstance(t, types.Integer) for t in index_types):
            return indexing(context, builder, kind, array, index_types, indices, boundscheck)
        fields = array._getvalue()

        def field(name: str, *axis: int) -> Any:
            return builder.extract_value(fields, (array._datamodel.get_field_position(name), *axis))

        axes = range(kind.ndim)
        shape = [field("shape", k) for k in axes]
        strides = [field("strides", k) for k in axes] if kind.layout == "A" else []
        places = [
            index
            if type(index) is llvm.Constant and index.type == shape[0].type and index.constant >= 0
            else numba_arrays.fix_integer_index(context, builder, index_type, index, length)
            for index, index_type, length in zip(indices, index_types, shape, strict=True)
        ]
        return item_pointer(context, builder, field("data"), shape, strides, kind.layout, places), [], []

    return basic_indexing


def _of_insertions(extract: Any) -> Any:
    """Returns llvmlite's extract_value, which makes no instruction if the value was inserted in the same function."""

    @wraps(extract)
    def extract_value(self: Any, whole: Any, place: Any, name: str = "") -> Any:
        path, source = list(place) if isinstance(place, tuple | list) else [place], whole
        while isinstance(source, llvm.instructions.InsertValue):
            if list(source.indices) == path:
                return source.value
            if source.indices[0] == path[0]:
                break
            source = source.aggregate
        return extract(self, whole, place, name)

    return extract_value


def _variables(find: Any) -> Any:
    """Returns numba's Inst._rec_list_vars, which is asked most often for what holds no variable."""
    without = {str, int, bool, type(None), numba_ir.Loc, type(len)}

    @wraps(find)
    def _rec_list_vars(self: Any, value: Any) -> Any:
        return [] if value.__class__ in without else find(self, value)

    return _rec_list_vars


numba_ir.Inst._rec_list_vars = _variables(numba_ir.Inst._rec_list_vars)
numba_arrays.basic_indexing = _with_short_way(numba_arrays.basic_indexing)
llvm.IRBuilder.extract_value = _of_insertions(llvm.IRBuilder.extract_value)


class _Compiling(event.Listener):
    """Whether numba compiles now (depth above 0), and for how many seconds it has compiled in this process."""

    def __init__(self) -> None:
        self.depth, self.seconds, self._begun, self._collects = 0, 0.0, 0.0, False

    def on_start(self, event: Any) -> None:
        if self.depth == 0:
            self._begun, self._collects = time.perf_counter(), gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self._begun
            if self._collects:
                gc.enable()


compiling = _Compiling()
register("numba:compile", compiling)


def clock() -> float:
    """Returns the seconds of a clock that stands still while kernels are compiled."""
    return time.perf_counter() - compiling.seconds


def _stored(kernel: Any) -> Any:
    return getattr(getattr(kernel, "_cache", None), "_cache_file", None)


def _used_by(function: Any) -> str:
    used = hashlib.sha256()
    for name, value in sorted(function.__globals__.items()):
        stored = _stored(value)
        if stored and value.__module__ != function.__module__:
            value = stored._source_stamp
        elif isinstance(value, np.ndarray):
            value = value.tobytes()
        elif not isinstance(value, bool | int | float | tuple | np.generic):
            continue
        used.update(f"{name} {value!r}\n".encode())
    return used.hexdigest()


if TYPE_CHECKING:  # a kernel is for mypy what numba's own decorator makes of it
    from numba import njit as njit

    shared_njit = njit
else:
    njit, shared_njit = cached_njit, partial(cached_njit, shared=True)


@cache
def _numba_finds_a_place(folder: str) -> bool:
    # Without a home, numba's cache folder would be one in the working directory.
    users = os.environ.get("XDG_CACHE_HOME", os.path.join(os.path.expanduser("~"), ".cache"))
    places = [os.path.join(folder, "__pycache__"), *([os.path.join(users, "numba")] if os.path.isabs(users) else [])]
    return any(_can_be_written(Path(place)) for place in places)


def _can_be_written(folder: Path) -> bool:
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    return existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)


def temporary_cache() -> str | None:
    """Returns the user's own folder for caches among the temporary files; None if it is not safe."""
    try:
        user = os.getuid() if hasattr(os, "getuid") else None
        folder = Path(tempfile.gettempdir()) / f"flockscope-kernels-{'' if user is None else user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        facts = folder.lstat()
    except OSError:
        return None
    # Caches hold code: nobody else may put files into the folder.
    own = user is None or (facts.st_uid == user and not facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
    return str(folder) if own and stat.S_ISDIR(facts.st_mode) and _can_be_written(folder) else None


@cache
def _warn_once() -> None:
    warnings.warn(NO_CACHE, stacklevel=2)
