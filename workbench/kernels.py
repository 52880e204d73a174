"""How kernels are compiled: Numba without the interpreter lock, cached on disk, in float64, bit-exact for any split."""

from numba import njit

#: Flags that keep NaN tests true and give the same bits whatever the length of the loop.
EXACT = {"contract", "nsz", "arcp"}

kernel = njit(nogil=True, cache=True, fastmath=EXACT, error_model="numpy")
"""Compile a kernel whose result may not depend on how a stretch of frames is split."""

modal_kernel = njit(nogil=True, cache=True, fastmath=EXACT | {"reassoc"}, error_model="numpy")
"""Compile a kernel whose inner loop runs over modes: sums over modes may be re-associated, sums over frames do not occur."""
