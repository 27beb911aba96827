"""The sway of people's strides, as a numba kernel. sim.crowd.forces names all columns."""

from __future__ import annotations

from math import sqrt

from sim.compiler import njit
from sim.crowd.forces import AMPLITUDE, COS, SIN, SWAY_X, SWAY_Y, X, Y

STRIDES = 0.807  # strides per s at 1 m/s: 0.0064 m of step per step/min (Sekiya & Nagasaki 1998)
SWAYLESS = 2.70  # m/s: on the line through amplitudes of 0.0350 m at 0.7 m/s and 0.0193 m at 1.6 m/s (Orendurff 2004)
USUAL_SPEED = 1.34  # m/s: speed to which the amplitude of a person's sway refers
SLOW = 0.3  # m/s: below, the amplitude falls to 0 with the speed
PI = 3.141592653589793


@njit(cache=True)
def sway(wanted, gait, dt, out):  # type: ignore[no-untyped-def]
    """Adds the acceleration by the sway of the strides to out (N, 2), and advances gait (N, 5) by dt (s).

    The sway is A(v) sin(phase) to the left of the wanted velocity (N, 2) of size v. The phase grows by 2 pi STRIDES
    sqrt(v) per s. A is the person's amplitude at USUAL_SPEED; it falls linearly to 0 at SWAYLESS, and below SLOW with
    the speed.
    """
    for i in range(len(gait)):
        pace = sqrt(wanted[i, X] * wanted[i, X] + wanted[i, Y] * wanted[i, Y])
        size = gait[i, AMPLITUDE] * max(0.0, (SWAYLESS - pace) / (SWAYLESS - USUAL_SPEED)) * min(1.0, pace / SLOW)
        rate = 2.0 * PI * STRIDES * sqrt(pace)
        half = 0.5 * rate * dt
        half += half * half * half / 3.0  # the tangent of half the angle by which the phase grows
        c, s, share = gait[i, COS], gait[i, SIN], 2.0 * half / (1.0 + half * half)
        gait[i, COS], gait[i, SIN] = c - share * (s + half * c), s + share * (c - half * s)
        per_speed = size * rate / max(pace, 1e-9)
        left_x, left_y = -per_speed * wanted[i, Y], per_speed * wanted[i, X]
        gait[i, SWAY_X], gait[i, SWAY_Y] = left_x * gait[i, COS], left_y * gait[i, COS]
        out[i, X] += left_x * (gait[i, COS] - c) / dt
        out[i, Y] += left_y * (gait[i, COS] - c) / dt
