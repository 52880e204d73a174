"""Present speed of the processor, as a reference for times.

Clock frequency varies, and other processes take their share. A time measured in a slow minute is compared with a
reference measured in that same minute. The reference is a loop of multiply-adds at full throughput, written for LLVM in
the processor's widest vectors, which reaches what C reaches with intrinsics.
"""

import time
from functools import cache
from typing import TYPE_CHECKING

from underfoot.kernels import Intrinsic, kernel, widest

if TYPE_CHECKING:
    from underfoot.emission import Emission, Type, TypingContext

FLOOR_NS = 0.045
"""Time of two multiply-adds on the processor of the best times in `requirements`, in its usual state: three gigahertz
and two vectors of 512 bits per cycle give 0.042.
"""

_CHAINS = 10
"""Enough vectors to hide the latency: two are begun per cycle, each takes four. Twice as many would not stay in the
registers of a processor with 256 bits.
"""
_AHEAD, _ROUNDS = 20_000, 60_000
"""Length of one measurement: some 0.1 ms, as long as the shortest runs, after a warm-up of the widest vectors."""


def slowness() -> float:
    """Return the present time of two multiply-adds in units of `FLOOR_NS`.

    >>> 0.1 < slowness() < 100.0
    True
    """
    _multiply_add(_AHEAD)
    began = time.thread_time()
    _multiply_add(_ROUNDS)
    return (time.thread_time() - began) / (_ROUNDS * _CHAINS * _lanes() / 2) * 1e9 / FLOOR_NS


@cache
def _lanes() -> int:
    """Return how many float64 are in the processor's widest vectors."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    return 8 if features.get("avx512f") else 4 if features.get("avx") else 2


@kernel
def _multiply_add(rounds: int) -> float:
    widest()
    return _chains(rounds)


@Intrinsic
def _chains(context: "TypingContext", rounds: "Type") -> "Emission":
    """Run rounds of `x = 0.5 x + 0.1` in each lane of each chain; return the sum of the first lanes."""
    from llvmlite import ir
    from numba import types

    from underfoot.emission import Arguments, BaseContext, Signature

    lanes, word = _lanes(), ir.IntType(64)
    vector = ir.VectorType(ir.DoubleType(), lanes)

    def constant(value: float) -> ir.Constant:
        return ir.Constant(vector, [value] * lanes)

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, args: Arguments) -> ir.Value:
        kind = ir.FunctionType(vector, [vector] * 3)
        fused = builder.module.declare_intrinsic(f"llvm.fmuladd.v{lanes}f64", fnty=kind)
        before = builder.block
        loop, after = builder.append_basic_block("floor"), builder.append_basic_block("floor.end")
        builder.branch(loop)
        builder.position_at_end(loop)
        count = builder.phi(word)
        count.add_incoming(ir.Constant(word, 0), before)
        chains = [builder.phi(vector) for _ in range(_CHAINS)]
        for k, chain in enumerate(chains):
            chain.add_incoming(constant(0.01 * k), before)
            chain.add_incoming(builder.call(fused, [constant(0.5), chain, constant(0.1)]), loop)
        following = builder.add(count, ir.Constant(word, 1))
        count.add_incoming(following, loop)
        builder.cbranch(builder.icmp_signed("<", following, args[0]), loop, after)
        builder.position_at_end(after)
        total = ir.Constant(ir.DoubleType(), 0.0)
        for chain in chains:
            total = builder.fadd(total, builder.extract_element(chain, ir.Constant(ir.IntType(32), 0)))
        return total

    return types.float64(types.int64), code
