"""Kernels for the largest set of mutually consistent members: a maximum clique on bit sets."""

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.posegraph.consistency_kernels import Bits
from glassslam.posegraph.structure_kernels import Integers

Int32s = NDArray[np.int32]


_PAIRS, _FOURS = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
_BYTES, _LOW_BYTE = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0xFF)


@kernel
def count_bits(word: np.uint64) -> int:
    """Number of bits set in one word."""
    word -= (word >> np.uint64(1)) & _PAIRS
    word = (word & _FOURS) + ((word >> np.uint64(2)) & _FOURS)
    word = (word + (word >> np.uint64(4))) & _BYTES
    for shift in (8, 16, 32):
        word += word >> np.uint64(shift)
    return int(word & _LOW_BYTE)


@kernel
def has_bit(row: Bits, index: int) -> bool:
    """Whether bit `index` is set."""
    found: bool = (row[index >> 6] >> np.uint64(index & 63)) & np.uint64(1) != np.uint64(0)
    return found


@kernel
def clear_bit(row: Bits, index: int) -> None:
    """Clear bit `index`."""
    row[index >> 6] &= ~(np.uint64(1) << np.uint64(index & 63))


@kernel
def greedy_clique(bits: Bits, order: Integers, starts: int) -> Integers:
    """Largest clique found by adding, from each of the first `starts` members, whoever fits, in `order`."""
    best = np.empty(0, dtype=np.int64)
    chosen = np.empty(order.size, dtype=np.int64)
    for s in range(min(starts, order.size)):
        candidates = bits[order[s]].copy()
        chosen[0] = order[s]
        size = 1
        for v in order:
            if has_bit(candidates, v):
                candidates &= bits[v]
                chosen[size] = v
                size += 1
        if size > best.size:
            best = chosen[:size].copy()
    return best


@kernel
def _colour(bits: Bits, candidates: Bits, members: Int32s, colours: Int32s, scratch: Bits) -> int:
    """Candidates sorted into independent sets: `members` by rising `colours`; how many there are.

    A clique takes at most one member of each colour, so the colour bounds its size.
    """
    left, free = scratch[0], scratch[1]
    left[:] = candidates
    count, colour, total = 0, 0, 0
    for w in range(left.size):
        total += count_bits(left[w])
    while count < total:
        colour += 1
        free[:] = left
        for word in range(free.size):
            while free[word] != np.uint64(0):
                low = free[word] & (~free[word] + np.uint64(1))
                v = 64 * word + count_bits(low - np.uint64(1))
                left[word] &= ~low
                free[word] &= ~low
                for w in range(word, free.size):
                    free[w] &= ~bits[v, w]
                members[count], colours[count] = v, colour
                count += 1
    return count


@kernel
def exact_clique(bits: Bits, at_least: int, budget: int) -> tuple[Integers, bool]:
    """Largest clique of more than `at_least` members, empty when there is none, and whether it is proven.

    Branch and bound with colouring bounds (San Segundo et al. 2011), given up after `budget`
    branches so that the answer never depends on the speed of the machine.
    """
    n = bits.shape[0]
    depth_limit = n + 1
    sets = np.zeros((depth_limit, bits.shape[1]), dtype=np.uint64)
    members, colours = np.zeros((depth_limit, n), dtype=np.int32), np.zeros((depth_limit, n), dtype=np.int32)
    position, chosen = np.zeros(depth_limit, dtype=np.int64), np.zeros(n, dtype=np.int64)
    scratch = np.zeros((2, bits.shape[1]), dtype=np.uint64)
    best = np.empty(0, dtype=np.int64)
    size, depth = at_least, 0
    for v in range(n):
        sets[0, v >> 6] |= np.uint64(1) << np.uint64(v & 63)
    position[0] = _colour(bits, sets[0], members[0], colours[0], scratch)
    while depth >= 0:
        position[depth] -= 1
        k = position[depth]
        if k < 0 or depth + colours[depth, k] <= size:
            depth -= 1
            continue
        if budget == 0:
            return best, False
        budget -= 1
        v = members[depth, k]
        chosen[depth] = v
        sets[depth + 1] = sets[depth] & bits[v]
        clear_bit(sets[depth], v)
        position[depth + 1] = _colour(bits, sets[depth + 1], members[depth + 1], colours[depth + 1], scratch)
        if position[depth + 1] == 0:
            if depth + 1 > size:
                size = depth + 1
                best = chosen[:size].copy()
            continue
        depth += 1
    return best, True
