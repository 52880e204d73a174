"""Types of code that emits machine code: what an intrinsic takes and returns, in Numba's and llvmlite's classes."""

from collections.abc import Callable, Sequence

from llvmlite import ir
from numba.core import types
from numba.core.base import BaseContext
from numba.core.pythonapi import _UnboxContext as UnboxContext
from numba.core.typing.context import BaseContext as TypingContext
from numba.core.typing.templates import Signature

__all__ = ["Arguments", "BaseContext", "Code", "Emission", "Signature", "Type", "TypingContext", "UnboxContext"]

Type = types.Type

Arguments = Sequence[ir.Value]
"""Arguments of the emitted code."""
Code = Callable[[BaseContext, ir.IRBuilder, Signature, Arguments], ir.Value]
"""Emits code, and returns its result."""
Emission = tuple[Signature, Code]
"""What an intrinsic returns: the types of its result and arguments, and the code."""
