"""All forces on everybody: where they want to go, then what they avoid on the way. Arrays and units:
sim.crowd.steering.
"""

from __future__ import annotations

from sim.crowd.avoidance_kernels import avoid
from sim.crowd.driving_kernels import drive
from sim.crowd.steering import Groups, Obstacles, People
from sim.types import Array


def accelerate(
    state: Array, people: People, groups: Groups, obstacles: Obstacles, dt: float, p: Array, push: Array, out: Array
) -> bool:
    """Accelerations of all into out (N, 2); advances the groups' ways and headings by dt.

    state (N, 4): x, y, vx, vy. p: Steering.array(). push (G, 2): scratch. Returns False where a state is not finite.
    """
    if not drive(state, *people, *groups, obstacles.stairs, dt, p, out):
        return False
    avoid(state, people.tag, groups.now, obstacles.walls, obstacles.pillars, p, push, out)
    return True
