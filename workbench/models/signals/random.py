"""Counter-based random numbers: a (key, counter) pair always gives the same number.

A sequence read by position needs no state, so sleep, block length and other tiles cannot shift it. The mixing function
is the finaliser of SplitMix64 (Steele, Lea and Flood 2014), applied twice.
"""

import hashlib
import math

import numpy as np

from underfoot.kernels import Floats, kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_30, _27, _31, _12, _32 = (np.uint64(shift) for shift in (30, 27, 31, 12, 32))


def stream_key(*names: object) -> np.uint64:
    """Return a 64-bit key for the stream of draws identified by `names` (seed, node id, tile id, ...).

    >>> int(stream_key(1, "noise", "t1")) == int(stream_key(1, "noise", "t1"))
    True
    >>> int(stream_key(1, "noise", "t1")) == int(stream_key(1, "noise", "t2"))
    False
    """
    text = "\x1f".join(str(name) for name in names)
    return np.uint64(int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little"))


@kernel
def _mix(z: np.uint64) -> np.uint64:
    z = (z ^ (z >> _30)) * _FIRST
    z = (z ^ (z >> _27)) * _SECOND
    return z ^ (z >> _31)


@kernel
def uniform(key: np.uint64, counter: int) -> float:
    """Return a float64 in (0, 1), excluding 0 and 1: draw `counter` (int64) of stream `key` (uint64).

    >>> 0.0 < uniform(np.uint64(1), 0) < 1.0
    True
    """
    bits = _mix(_mix(np.uint64(key) + np.uint64(counter) * _GOLDEN) ^ (np.uint64(key) >> _32))
    return open_unit(bits)


@kernel
def open_unit(bits: np.uint64) -> float:
    """Convert 64 random `bits` (uint64) to a float64 in (0, 1), the midpoint of one of 2^52 equal cells.

    With one bit more, the midpoint of the highest cell would round to 1.
    """
    return (np.float64(bits >> _12) + 0.5) * 2.0**-52


@kernel
def exponential(key: np.uint64, counter: int) -> float:
    """Return draw `counter` of stream `key`, exponential with mean 1.

    >>> exponential(np.uint64(1), 0) > 0.0
    True
    """
    return -math.log(uniform(key, counter))


@kernel
def normal(key: np.uint64, counter: int) -> float:
    """Return draw `counter` of stream `key`, standard normal (Box and Muller; uses two uniforms).

    >>> abs(normal(np.uint64(1), 0)) < 9.0
    True
    """
    radius = math.sqrt(-2.0 * math.log(uniform(key, 2 * counter)))
    return radius * math.cos(2.0 * math.pi * uniform(key, 2 * counter + 1))


@kernel
def normals(key: np.uint64, counter: int, out: Floats) -> None:
    """Fill `out` with the standard normal draws of stream `key` from `counter` on."""
    for i in range(out.size):
        out[i] = normal(key, counter + i)
