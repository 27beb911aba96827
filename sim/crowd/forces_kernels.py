"""The sum of all forces of sim.crowd.forces as one kernel, `accelerate`: a call from Python costs time for each array."""

from __future__ import annotations

from sim.compiler import njit
from sim.crowd.forces_avoidance_kernels import avoid
from sim.crowd.forces_goal_kernels import drive, sway


@njit(cache=True)
def accelerate(  # type: ignore[no-untyped-def]
    state, place, target, pace, noise, gait, calm, wanted, tag,
    route, kind, length, current, speed, heading, finish, arrived, status, push, by_x,
    stairs, walls, pillars, dt, out,
):  # fmt: skip
    """Overwrites out (N, 2) with the accelerations of all people, m/s², and advances ways and strides by dt (s).

    state (N, 4): x, y, vx, vy, m and m/s. The others are the fields of PeopleArrays, GroupArrays and Obstacles. stairs:
    None without stairs; walls: None without walls and pillars. Returns True; False, with nothing written, if a state is
    nan or the sum of its absolute values reaches 1e9.
    """
    if not drive(
        state, place, target, pace, noise, gait, calm, wanted, tag,
        route, kind, length, current, speed, heading, finish, arrived, status, stairs, dt, out,
    ):  # fmt: skip
        return False
    sway(wanted, gait, dt, out)
    avoid(calm, tag, status, push, by_x, walls, pillars, out)
    return True
