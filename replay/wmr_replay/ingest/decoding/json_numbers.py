"""Decimal numbers of JSON to the nearest double, compiled. Numbers beyond its reach are refused.

Up to 2⁵³ and 10^±22 one exact product or quotient (Clinger 1990); otherwise the algorithm of Eisel and
Lemire ("Number parsing at a gigabyte per second", Software: Practice and Experience 51, 2021, section 5): the
mantissa times a 128-bit power of five, whose upper bits hold the answer.
"""

from typing import Any

import numpy as np

from wmr_schemas.arrays import U8
from wmr_schemas.compiled.lean import lean

MAX_DIGITS = 19
"""So many decimal digits always fit in 64 bits."""
_MIN_POWER, _MAX_POWER = -342, 308
_EXACT_POWERS, _EXACT_MANTISSA = 22, np.uint64(1 << 53)
_ZERO, _NINE, _MINUS, _PLUS, _POINT, _E, _SMALL_E = (ord(char) for char in "09-+.Ee")
_MASK32 = np.uint64((1 << 32) - 1)
_HIDDEN = np.uint64(1 << 52)
_SPARE_BITS = 64 - 52 - 3
_TENS = np.array([float(10**k) for k in range(_EXACT_POWERS + 1)])


def _power_of_five(q: int) -> Any:
    """5^q as a mantissa of 128 bits, rounded down for q ≥ 0 and up for q < 0."""
    if q >= 0:
        power = 5**q
        shift = power.bit_length() - 128
        return power >> shift if shift > 0 else power << -shift
    power = 5**-q
    bits = (power - 1).bit_length()
    value = (1 << (bits + 127 if q >= -27 else 2 * bits + 128)) // power + 1
    return value >> max(value.bit_length() - 128, 0)


_POWERS = np.array([divmod(_power_of_five(q), 1 << 64) for q in range(_MIN_POWER, _MAX_POWER + 1)], np.uint64)


@lean
def _product(a: Any, b: Any) -> Any:
    """The 128 bits of a·b: upper and lower word."""
    a0, a1, b0, b1 = a & _MASK32, a >> np.uint64(32), b & _MASK32, b >> np.uint64(32)
    p01, p10 = a0 * b1, a1 * b0
    middle = ((a0 * b0) >> np.uint64(32)) + (p01 & _MASK32) + (p10 & _MASK32)
    upper = a1 * b1 + (p01 >> np.uint64(32)) + (p10 >> np.uint64(32)) + (middle >> np.uint64(32))
    return upper, a * b


@lean
def _leading_zeros(value: Any) -> int:
    """Number of zero bits above the highest set bit of a positive 64-bit word."""
    zeros = 0
    for step in (32, 16, 8, 4, 2, 1):
        free = (value >> np.uint64(64 - step)) == 0
        value <<= np.uint64(step * free)
        zeros += step * free
    return zeros


@lean
def _eisel_lemire(mantissa: Any, power: int) -> Any:
    """mantissa·10^power, mantissa > 0; infinite for numbers too large or too small to be normal."""
    zeros = _leading_zeros(mantissa)
    shifted = mantissa << np.uint64(zeros)
    row = power - _MIN_POWER
    upper, lower = _product(shifted, _POWERS[row, 0])
    if upper & np.uint64((1 << _SPARE_BITS) - 1) == np.uint64((1 << _SPARE_BITS) - 1):
        more, _ = _product(shifted, _POWERS[row, 1])
        lower += more
        upper += np.uint64(lower < more)
    top = np.int64(upper >> np.uint64(63))
    found = upper >> np.uint64(top + _SPARE_BITS)
    exponent = ((217706 * power) >> 16) + 63 + top - zeros + 1023
    if (
        lower <= 1
        and -4 <= power <= 23
        and found & np.uint64(3) == 1
        and found << np.uint64(top + _SPARE_BITS) == upper
    ):
        found -= np.uint64(1)  # halfway between two doubles: the even one
    found = (found + (found & np.uint64(1))) >> np.uint64(1)
    if found >= _HIDDEN << np.uint64(1):
        found, exponent = _HIDDEN, exponent + 1
    if not 0 < exponent < 0x7FF:
        return np.inf
    return np.uint64((found ^ _HIDDEN) | (np.uint64(exponent) << np.uint64(52))).view(np.float64)


@lean
def digits(data: U8, words: Any, position: int, stop: int, value: Any) -> Any:
    """The number that goes on with the digits at ``position``, and where they end; eight at a time."""
    while position + 8 <= stop:
        word = words[position]
        high = word & np.uint64(0xF0F0F0F0F0F0F0F0)
        over = (word + np.uint64(0x0606060606060606)) & np.uint64(0xF0F0F0F0F0F0F0F0)
        if high | (over >> np.uint64(4)) != np.uint64(0x3333333333333333):
            break
        word -= np.uint64(0x3030303030303030)
        word = word * np.uint64(10) + (word >> np.uint64(8))
        even = (word & np.uint64(0x000000FF000000FF)) * np.uint64(0x000F424000000064)
        odd = ((word >> np.uint64(16)) & np.uint64(0x000000FF000000FF)) * np.uint64(0x0000271000000001)
        value = value * np.uint64(100_000_000) + ((even + odd) >> np.uint64(32))
        position += 8
    while position < stop and _ZERO <= data[position] <= _NINE:
        value = value * np.uint64(10) + np.uint64(data[position] - _ZERO)
        position += 1
    return value, position


@lean
def _exponent(data: U8, position: int, stop: int) -> Any:
    """The exponent after ``e``, and where it ends (−1: it is none, or beyond any number)."""
    negative = position < stop and data[position] == _MINUS
    if position < stop and data[position] in (_MINUS, _PLUS):
        position += 1
    value, begin = 0, position
    while position < stop and _ZERO <= data[position] <= _NINE and position - begin < 5:
        value = value * 10 + data[position] - _ZERO
        position += 1
    return (-value if negative else value), (position if 0 < position - begin < 5 else -1)


@lean
def _n_leading(data: U8, position: int, stop: int) -> int:
    """How many zeros stand before the first other digit."""
    n = 0
    while position < stop and data[position] in (_ZERO, _POINT):
        n += data[position] == _ZERO
        position += 1
    return n


@lean
def _scaled(mantissa: Any, power: int) -> Any:
    """mantissa·10^power; infinite where that cannot be told here."""
    if mantissa <= _EXACT_MANTISSA and -_EXACT_POWERS <= power <= _EXACT_POWERS:
        exact = np.float64(mantissa)
        return exact * _TENS[power] if power >= 0 else exact / _TENS[-power]
    if mantissa == 0:
        return 0.0
    return _eisel_lemire(mantissa, power) if _MIN_POWER <= power <= _MAX_POWER else np.inf


@lean
def decimal(data: U8, words: Any, position: int, stop: int) -> Any:
    """The JSON number at ``position``, and where it ends.

    The end is −1 where there is no number, or one that has to be read with more care.
    """
    negative = position < stop and data[position] == _MINUS
    begin = position + 1 if negative else position
    mantissa, position = digits(data, words, begin, stop, np.uint64(0))
    n_digits, power = position - begin, 0
    if n_digits == 0 or (n_digits > 1 and data[begin] == _ZERO):
        return np.nan, -1
    if position < stop and data[position] == _POINT:
        first = position + 1
        mantissa, position = digits(data, words, first, stop, mantissa)
        power = first - position
        if power == 0:
            return np.nan, -1
        n_digits -= power
    if n_digits > MAX_DIGITS and n_digits - _n_leading(data, begin, position) > MAX_DIGITS:
        return np.nan, -1
    if position < stop and data[position] in (_E, _SMALL_E):
        more, position = _exponent(data, position + 1, stop)
        power += more
    value = _scaled(mantissa, power)
    return (-value if negative else value), (position if value < np.inf else -1)


@lean
def integer(data: U8, words: Any, position: int, stop: int) -> Any:
    """The whole number at ``position``, and where it ends: −1 where there is none."""
    negative = position < stop and data[position] == _MINUS
    begin = position + 1 if negative else position
    value, position = digits(data, words, begin, stop, np.uint64(0))
    if not 0 < position - begin < MAX_DIGITS:
        return 0, -1
    return (-np.int64(value) if negative else np.int64(value)), position
