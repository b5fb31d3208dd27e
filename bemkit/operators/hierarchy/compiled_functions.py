"""Logarithm and angle without branches, for loops that numba vectorises; import it through `compiled` alone.

The functions of the mathematical library are called for one number at a time, which costs four times as much as
everything else in a closed form. The reduction of the logarithm is that of fdlibm; the arc tangent is a polynomial that
interpolates at the Chebyshev points of [0, tan(pi / 8)]. Both are good to three units of the last place. Compilers must
not reassociate them: the logarithm adds and subtracts 2^52.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

MATHEMATICS: Any = {"contract", "nsz", "nnan", "ninf", "arcp"}
"""What the compiler may do to formulas that contain these functions."""
OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
"""Of all functions that are compiled on their own."""
_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD
_ONE_BITS = 0x3FF0000000000000
_MANTISSA = 0x000FFFFFFFFFFFFF
_TWO_52_BITS = 0x4330000000000000
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_SMALLEST = 1e-300
_TAN_EIGHTH = 0.41421356237309503
_PI, _PI_LOW = np.pi, 1.2246467991473532e-16
_ATAN = (
    1.0, -0.3333333333333312, 0.19999999999940893, -0.14285714279250245, 0.11111110744919658, -0.09090896809064027,
    0.07692045330902225, -0.06662951813629191, 0.05846878297330872, -0.05035102456601552, 0.03796525745386593,
    -0.017805397205419446,
)  # fmt: skip
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11 = _ATAN


@numba.njit(inline="always", error_model="numpy")
def log(x: float) -> float:
    """Return the natural logarithm of a positive number, not below 1e-300."""
    bits = np.float64(x).view(np.int64)
    # the mantissa between sqrt(1/2) and sqrt(2)
    shifted = bits + (_ONE_BITS - _SQRT_HALF_BITS)
    exponent = np.int64(((shifted >> 52) & 0xFFF) | _TWO_52_BITS).view(np.float64) - 4503599627370496.0 - 1023.0
    f = np.int64((shifted & _MANTISSA) + _SQRT_HALF_BITS).view(np.float64) - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01))
    odd = z * (
        6.666666666666735130e-01
        + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01))
    )
    half = 0.5 * f * f
    return exponent * _LN2_HIGH - ((half - (s * (half + even + odd) + exponent * _LN2_LOW)) - f)


@numba.njit(inline="always", error_model="numpy")
def atan2(y: float, x: float) -> float:
    """Return the angle from the first axis to (x, y)."""
    high, wide = abs(y), abs(x)
    large, small = max(wide, high), min(wide, high)
    is_turned = small > _TAN_EIGHTH * large  # by pi / 4, so that the quotient is small
    above = (small - large) if is_turned else small
    below = (small + large) if is_turned else large
    q = above / (below + _SMALLEST)
    z = q * q
    z2 = z * z
    z4 = z2 * z2
    z8 = z4 * z4
    first = ((_A0 + _A1 * z) + z2 * (_A2 + _A3 * z)) + z4 * ((_A4 + _A5 * z) + z2 * (_A6 + _A7 * z))
    angle = q * (first + z8 * ((_A8 + _A9 * z) + z2 * (_A10 + _A11 * z)))
    angle = (angle + 0.25 * _PI_LOW) + 0.25 * _PI if is_turned else angle
    angle = 0.5 * _PI - (angle - 0.5 * _PI_LOW) if high > wide else angle
    angle = _PI - (angle - _PI_LOW) if x < 0.0 else angle
    return -angle if y < 0.0 else angle
