"""The order of hypotheses by weight.

Written out here, since an order that numpy's or numba's sort leaves open among equal weights would decide
which of two equal hypotheses is kept: this one is fixed (quicksort by the median of three, insertion sort
below 16), and compiles in a fraction of the time.
"""

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean

SMALL = 15
"""Longer stretches are partitioned, shorter ones sorted by insertion."""
STACK_ROWS = 64


@lean
def swap(order: I64, i: int, j: int) -> None:
    """Exchange two entries."""
    order[i], order[j] = order[j], order[i]


@lean
def sort_by_insertion(weight: F64, order: I64, low: int, high: int) -> None:
    """Sort ``order[low:high + 1]`` by falling weight."""
    for i in range(low + 1, high + 1):
        k = order[i]
        j = i
        while j > low and weight[k] > weight[order[j - 1]]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = k


@lean
def sort_indices(indices: I64, n: int) -> None:
    """Sort the first n ``indices`` by value."""
    for i in range(1, n):
        value = indices[i]
        j = i
        while j > 0 and indices[j - 1] > value:
            indices[j] = indices[j - 1]
            j -= 1
        indices[j] = value


@lean
def partition(weight: F64, order: I64, low: int, high: int) -> int:
    """Split ``order[low:high + 1]`` about a pivot; the pivot's place."""
    mid = (low + high) >> 1
    for a, b in ((low, mid), (mid, high), (low, mid)):
        if weight[order[b]] > weight[order[a]]:
            swap(order, a, b)
    pivot = weight[order[mid]]
    swap(order, high, mid)
    i, j = low, high - 1
    while True:
        while i < high and weight[order[i]] > pivot:
            i += 1
        while j >= low and pivot > weight[order[j]]:
            j -= 1
        if i >= j:
            break
        swap(order, i, j)
        i += 1
        j -= 1
    swap(order, i, high)
    return i


@lean
def order_by_weight(weight: F64, n: int, order: I64, stack: I64) -> None:
    """The first n indices by falling ``weight``, into ``order``; ``stack`` (64, 2) is scratch."""
    for i in range(n):
        order[i] = i
    stack[0, 0], stack[0, 1] = 0, n - 1
    waiting = 1
    while waiting > 0:
        waiting -= 1
        low, high = stack[waiting, 0], stack[waiting, 1]
        while high - low >= SMALL:
            i = partition(weight, order, low, high)
            if high - i > i - low:
                stack[waiting, 0], stack[waiting, 1] = i + 1, high
                high = i - 1
            else:
                stack[waiting, 0], stack[waiting, 1] = low, i - 1
                low = i + 1
            waiting += 1
        sort_by_insertion(weight, order, low, high)
