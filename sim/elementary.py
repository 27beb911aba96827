"""Elementary functions, lengths and matrix products with the same bits on every processor.

The C library, numpy and BLAS choose their code by processor, and their last bits differ. Motion, truth and simulated
detections must not depend on that. The functions here use additions, multiplications, divisions and square roots of
IEEE 754 in a fixed order, and exact scaling by powers of 2. An architecture test keeps other implementations out of the
packages that decide the truth.

Arguments are reduced in the usual way (Cody & Waite 1980), then a Taylor series follows. Errors are at most a few units
in the last place, for angles up to 1e5 rad. Each function takes and returns arrays or scalars; nan stays nan.
`sim.elementary_kernels` compiles the same functions for use inside kernels, so each body stands alone: it calls nothing
of this module.
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

from sim.types import Array

# ln 2 and pi / 2 in parts: the first ones have 33 bits, so that their products with small integers are exact
LN2_HIGH, LN2_LOW = 0.6931471804855391, 7.440617110012397e-11
HALF_PI_1, HALF_PI_2, HALF_PI_3 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
PER_LN2, PER_HALF_PI = 1.4426950408889634, 0.6366197723675814
PI, QUARTER_PI = 3.141592653589793, 0.7853981633974483
LEAST, GREATEST = -744.0, 709.0  # exp neither vanishes nor overflows between them
SQRT_HALF, TAN_22_5 = 0.7071067811865476, 0.4142135623730951

POWERS_OF_2 = np.ldexp(1.0, np.arange(-1074, 1024))
# series from the highest power down
E2, E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13 = (1.0 / factorial(n) for n in range(2, 14))
SIN_SERIES = tuple((-1.0) ** n / factorial(2 * n + 1) for n in range(8, -1, -1))
COS_SERIES = tuple((-1.0) ** n / factorial(2 * n) for n in range(8, -1, -1))
ATANH_SERIES = tuple(1.0 / (2 * n + 1) for n in range(11, -1, -1))
ATAN_BLOCKS = tuple(tuple((-1.0) ** n / (2 * n + 1) for n in range(k, k + 4)) for k in range(20, -1, -4))

# Wichura 1988, algorithm AS 241 (PPND16): numerators and denominators of the normal quantile near 0.5, then in the
# tail, for r = sqrt(-log(tail)) up to 5 and beyond
CENTRE_TOP = (
    2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4, 4.5921953931549871457e4,
    1.3731693765509461125e4, 1.9715909503065514427e3, 1.3314166789178437745e2, 3.3871328727963666080,
)  # fmt: skip
CENTRE_BELOW = (
    5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4, 2.1213794301586595867e4,
    5.3941960214247511077e3, 6.8718700749205790830e2, 4.2313330701600911252e1, 1.0,
)  # fmt: skip
TAIL_TOP = (
    7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1, 1.27045825245236838258,
    3.64784832476320460504, 5.76949722146069140550, 4.63033784615654529590, 1.42343711074968357734,
)  # fmt: skip
TAIL_BELOW = (
    1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
    6.89767334985100004550e-1, 1.67638483018380384940, 2.05319162663775882187, 1.0,
)  # fmt: skip
FAR_TOP = (
    2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3, 2.65321895265761230930e-2,
    2.96560571828504891230e-1, 1.78482653991729133580, 5.46378491116411436990, 6.65790464350110377720,
)  # fmt: skip
FAR_BELOW = (
    2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5, 7.86869131145613259100e-4,
    1.48753612908506148525e-2, 1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0,
)  # fmt: skip


def exp(x: Any) -> Any:
    """Returns e to the power x; x below -744 counts as -744, x above 709 as 709. x must not be nan."""
    x = np.minimum(np.maximum(x, LEAST), GREATEST)
    k = np.floor(x * PER_LN2 + 0.5)
    r = (x - k * LN2_HIGH) - k * LN2_LOW
    q = r * r
    four = q * q  # in blocks of four powers, which a processor computes side by side
    series = E12 + E13 * r
    series = ((E8 + E9 * r) + q * (E10 + E11 * r)) + four * series
    series = ((E4 + E5 * r) + q * (E6 + E7 * r)) + four * series
    series = ((1.0 + r) + q * (E2 + E3 * r)) + four * series
    return series * POWERS_OF_2[np.int64(k) + 1074]


def log(x: Any) -> Any:
    """Returns the natural logarithm of x > 0."""
    m, e = np.frexp(x)
    small = np.float64(m < SQRT_HALF)
    m, e = m + m * small, e - small
    s = (m - 1.0) / (m + 1.0)
    q = s * s
    series = 0.0 * q
    for c in ATANH_SERIES:
        series = series * q + c
    return (2.0 * s * series + e * LN2_LOW) + e * LN2_HIGH


def sin(x: Any) -> Any:
    """Returns the sine of x, rad."""
    k = np.floor(x * PER_HALF_PI + 0.5)
    r = ((x - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3
    q = r * r
    sine, cosine = 0.0 * q, 0.0 * q
    for c in SIN_SERIES:
        sine = sine * q + c
    for c in COS_SERIES:
        cosine = cosine * q + c
    quarter = k - 4.0 * np.floor(k * 0.25)
    odd = np.float64((quarter == 1.0) | (quarter == 3.0))  # selects by 0 and 1: np.where is slow for scalars in kernels
    return (odd * cosine + (1.0 - odd) * (sine * r)) * (1.0 - 2.0 * np.float64(quarter > 1.5))


def cos(x: Any) -> Any:
    """Returns the cosine of x, rad."""
    k = np.floor(x * PER_HALF_PI + 0.5)
    r = ((x - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3
    q = r * r
    sine, cosine = 0.0 * q, 0.0 * q
    for c in SIN_SERIES:
        sine = sine * q + c
    for c in COS_SERIES:
        cosine = cosine * q + c
    quarter = k - 4.0 * np.floor(k * 0.25)
    odd = np.float64((quarter == 1.0) | (quarter == 3.0))
    negative = np.float64((quarter == 1.0) | (quarter == 2.0))
    return (odd * (sine * r) + (1.0 - odd) * cosine) * (1.0 - 2.0 * negative)


def atan2(y: Any, x: Any) -> Any:
    """Returns the angle of the vector (x, y), rad, from -pi to pi; 0 for the zero vector."""
    a, b = np.abs(x), np.abs(y)
    low, high = np.minimum(a, b), np.maximum(a, b)
    t = low / (high + np.float64(high == 0.0))
    far, steep, behind = np.float64(t > TAN_22_5), np.float64(b > a), np.float64(x < 0.0)
    r = far * ((t - 1.0) / (t + 1.0)) + (1.0 - far) * t
    q = r * r
    two = q * q
    four, series = two * two, 0.0 * q
    for a0, a1, a2, a3 in ATAN_BLOCKS:
        series = ((a0 + a1 * q) + two * (a2 + a3 * q)) + four * series
    angle = series * r + far * QUARTER_PI
    angle = steep * (2.0 * QUARTER_PI - angle) + (1.0 - steep) * angle
    angle = behind * (PI - angle) + (1.0 - behind) * angle
    return angle * (1.0 - 2.0 * np.float64(y < 0.0))


def power(x: Any, exponent: float) -> Any:
    """Returns x to the power `exponent`, for x >= 0. 0 to the power 0 is 1, 0 to any other power is 0."""
    if exponent == 0.0:
        return np.ones_like(x, dtype=float)
    return np.where(x > 0.0, exp(exponent * log(np.where(x > 0.0, x, 1.0))), np.where(x == 0.0, 0.0, np.nan))


def normal_quantile(u: Any) -> Any:
    """Returns the quantile of the standard normal distribution at u, 0 < u < 1 (Wichura 1988, AS 241)."""
    centred = u - 0.5
    near = 0.180625 - centred * centred
    centre = centred * _ratio(CENTRE_TOP, CENTRE_BELOW, near)
    if np.ndim(u) == 0:
        return centre if near >= 0.0 else float(_tail_quantile(u))
    far = near < 0.0
    centre[far] = _tail_quantile(u[far])
    return centre


def _tail_quantile(u: Any) -> Any:
    r = np.sqrt(-log(np.minimum(u, 1.0 - u)))
    beyond = np.where(r <= 5.0, _ratio(TAIL_TOP, TAIL_BELOW, r - 1.6), _ratio(FAR_TOP, FAR_BELOW, r - 5.0))
    return np.where(u < 0.5, -beyond, beyond)


def _ratio(top: tuple[float, ...], below: tuple[float, ...], x: Any) -> Any:
    p, q = 0.0 * x, 0.0 * x
    for a, b in zip(top, below, strict=True):
        p, q = p * x + a, q * x + b
    return p / q


def length(v: Array) -> Array:
    """Returns the lengths (...) of vectors (..., D)."""
    return np.asarray(np.sqrt(dot(v, v)))


def dot(a: Array, b: Array) -> Array:
    """Returns the scalar products (...) of vectors a and b (..., D); the summands are added in their order."""
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return np.asarray(total)


def product(a: Array, b: Array) -> Array:
    """Returns the matrix products (..., I, J) of a (..., I, K) and b (..., K, J); summands are added in their order."""
    total = a[..., :, 0, None] * b[..., None, 0, :]
    for k in range(1, a.shape[-1]):
        total = total + a[..., :, k, None] * b[..., None, k, :]
    return np.asarray(total)


def turned(matrix: Array, v: Array) -> Array:
    """Returns the products (..., I) of one matrix (I, K) and vectors v (..., K)."""
    return product(v[..., None, :], matrix.T)[..., 0, :]


def inverse_3x3(m: Array) -> Array:
    """Returns the inverses (..., 3, 3) of matrices; a singular one gives inf or nan, with a numpy warning."""
    rows = m[..., 0, :], m[..., 1, :], m[..., 2, :]
    columns = [np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])]
    return np.stack(columns, axis=-1) / dot(rows[0], columns[0])[..., None, None]


def unit(angle: Any) -> Array:
    """Returns the unit vectors (..., 2) at angles (...), rad, counter-clockwise from +x."""
    return np.stack([cos(angle), sin(angle)], axis=-1)
