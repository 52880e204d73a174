"""How kernels are compiled: Numba without the interpreter lock, cached on disk, in strict float64.

Strict, because a kernel exists more than once: on its own, inlined in its callers, and in every process's cache. Where
the compiler may contract or re-order, these copies differ in their last bits (measured: a tone's bytes changed between
the process that compiled it and the next one, which loaded it), and the same patch must give the same bytes.
"""

from numba import njit, types
from numba.extending import intrinsic

kernel = njit(nogil=True, cache=True, error_model="numpy")
"""Compile a kernel whose bits do not depend on how a stretch of frames is split, nor on who compiled it."""

modal_kernel = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp", "reassoc"})
"""Compile a kernel whose inner loop runs over modes: it may contract, and re-associate sums over modes."""


@intrinsic
def widest(context):
    """Let the loops of the kernel that calls this use the processor's widest vectors.

    The compiler prefers half of them where there are 512 bits. Long loops over modes gain a quarter to a third from all
    (measured at 64 and 200 modes); short loops, of which everything else is made, lose.
    """

    def code(context, builder, signature, args):
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')  # past llvmlite's list of known names
        return context.get_dummy_value()

    return types.void(), code
