"""Makes numba compile faster: code that only kernels call, types of sums, elements of arrays.

What kernels call has no wrapper for calls from Python, and LLVM optimises it within its callers only; so with numba's
own functions, such as np.empty. numba's answers to what type `a + b` has are remembered. `a[i, j]` needs
fewer instructions than numba's. Results are the same to the last bit. The changes hold for the whole process. What
is replaced is looked up before the first change: if it is missing, the import fails and numba stays as it was.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from typing import Any

from numba.core import cgutils, codegen, compiler, targetconfig, types
from numba.core.typing import templates
from numba.np import arrayobj

InnerLibrary: Any = codegen.JITCodeLibrary
KernelCompiler: Any = compiler.Compiler
function_type: Any = types.BaseFunction
overload_template: Any = templates._OverloadFunctionTemplate
array_module: Any = arrayobj
compilation_flags: Any = targetconfig.ConfigStack
numba_codegen: Any = codegen
Constant: Any = numba_codegen.llvmir.Constant
unliteral: Any = types.unliteral
item_pointer: Any = cgutils.get_item_pointer2
wrapped_index: Any = arrayobj.fix_integer_index


class _InnerCode(InnerLibrary):  # type: ignore[misc]
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


class _InnerCompiler(KernelCompiler):  # type: ignore[misc]
    def define_pipelines(self) -> Any:
        self.state.library = _InnerCode(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _InnerCompiler}


def _of_inner_code(decorator: Any) -> Any:
    """Returns numba's _get_jit_decorator, for functions of its own such as np.empty."""
    return wraps(decorator)(lambda self: partial(decorator(self), **INNER))


def _with_memory(resolve: Any) -> Any:
    """Returns numba's BaseFunction.get_call_type, with a memory for operators.

    It asks some thirty templates, each time anew, what type `a + b` has. Of numbers, those with lists of types know it.
    Answers about others may depend on the options of the kernel, and are remembered for each choice of them.
    """
    known: dict[Any, Any] = {}

    def of_numbers(self: Any, context: Any, args: Any) -> Any:
        plain = tuple(unliteral(a) for a in args)
        if all(isinstance(a, types.Number | types.Boolean) for a in plain):
            for template in (t(context) for t in self.templates if issubclass(t, templates.ConcreteTemplate)):
                signature = template.apply(plain, {})
                if signature is not None:
                    return signature, template.get_impl_key(signature)
        return None

    @wraps(resolve)
    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws or getattr(self.typing_key, "__module__", "") != "_operator":
            return resolve(self, context, args, kws)
        call: Any = self, context, tuple(args)
        if call not in known:
            known[call] = of_numbers(self, context, args)
        if known[call] is None:
            call = *call, compilation_flags.top_or_none()
            if call not in known:
                signature = resolve(self, context, args, kws)
                known[call] = signature, self._impl_keys[signature.args]
        signature, implementation = known[call]
        self._impl_keys[signature.args] = implementation
        return signature

    return get_call_type


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
            if type(index) is Constant and index.type == shape[0].type and index.constant >= 0
            else wrapped_index(context, builder, index_type, index, length)
            for index, index_type, length in zip(indices, index_types, shape, strict=True)
        ]
        return item_pointer(context, builder, field("data"), shape, strides, kind.layout, places), [], []

    return basic_indexing


REPLACED: tuple[tuple[Any, str, Callable[[Any], Any]], ...] = (
    (overload_template, "_get_jit_decorator", _of_inner_code),
    (function_type, "get_call_type", _with_memory),
    (array_module, "basic_indexing", _with_short_way),
)
_made = [(owner, name, replaced(getattr(owner, name))) for owner, name, replaced in REPLACED]
for _owner, _name, _function in _made:
    setattr(_owner, _name, _function)
