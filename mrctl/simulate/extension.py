"""What numba has to be told before it can compile the model: two functions' bodies."""
# numba's extension API is untyped.
# mypy: disable-error-code="no-untyped-call, call-arg, untyped-decorator"
# ruff: noqa: ANN401 - its arguments are types that numba makes up

from __future__ import annotations

import bisect
from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from mrctl.simulate import loops


@overload(bisect.bisect_right, jit_options={"forceinline": True})
def bisect_right(knots: Any, x: Any) -> Any:  # noqa: ARG001 - numba types
    """Where x belongs in sorted knots, right of equals: as in the standard library."""

    def body(knots: Any, x: Any) -> Any:
        low, high = 0, len(knots)
        while low < high:
            middle = (low + high) >> 1
            if x < knots[middle]:
                high = middle
            else:
                low = middle + 1
        return low

    return body


@intrinsic
def _uncounted(typing: Any, tables: Any) -> Any:  # noqa: ARG001 - numba's signature
    """The tables, their arrays without reference counts: the caller of the loop holds them anyway."""

    def body(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (named,) = signature.args
        values = cgutils.unpack_tuple(builder, arguments[0], len(named))
        for k, kind in enumerate(named.types):
            if isinstance(kind, types.Array):
                array = cgutils.create_struct_proxy(kind)(context, builder, value=values[k])
                array.meminfo = cgutils.get_null_value(array.meminfo.type)
                values[k] = array._getvalue()  # noqa: SLF001 - numba's own way to do it
        return context.make_tuple(builder, named, values)

    return tables(tables), body


@overload(loops.borrowed)
def borrowed(tables: Any) -> Any:  # noqa: ARG001 - numba types
    """The tables, quick to read at every sample."""

    def body(tables: Any) -> Any:
        return _uncounted(tables)

    return body
