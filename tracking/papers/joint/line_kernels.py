"""Kernels of people in lines (ours): a group that talks stands in a circle, people who wait for their turn in a line.

A group of three or more is a line if its people are within FLAT of a straight line and stand or move along it; a group
that walks abreast moves across its line. Two people are in a line with a third one, of any group, if one of the three
is between the others, less than REACH from both, and they stand or move along the line. Circles of conversing groups
are the F-formations of Cristani et al. 2011, the paper's reference [7].
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import clusters, same_row

REACH = 1.5
"""Largest distance of neighbours in a line, m."""
DETOUR = 0.1
"""Three people are in no line if the way past the middle one is longer by this than the straight way, m."""
FLAT = 0.15
"""Three or more people are no line if their standard deviation across the best line is larger, m."""
ACROSS = 0.3
"""Standard deviation of the speed across a line, m/s."""
UNLIKE = 0.4
"""Standard deviation of the difference of the velocities of three people in a line, m/s."""


@njit(cache=True)
def lines_of(state: Array, out: Array) -> None:
    """Write how much each pair of people is in one line, (K, K), 0 to 1: the largest value of three people with both.

    state (K, 4): x, y, m, vx, vy, m/s. The value of three people is max(0, 1 - detour / DETOUR) exp(-(v / ACROSS)^2 /
    2 - (u / UNLIKE)^2 / 2), with v the part of their mean velocity across the straight way between the outer two, and u
    the root mean square difference of their velocities from the mean.
    """
    n = len(state)
    out[:] = 0.0
    for m in range(n):
        for a in range(n):
            ax, ay = state[a, 0] - state[m, 0], state[a, 1] - state[m, 1]
            to_a = math.sqrt(ax * ax + ay * ay)
            if a == m or to_a > REACH:
                continue
            for b in range(a):
                bx, by = state[b, 0] - state[m, 0], state[b, 1] - state[m, 1]
                to_b = math.sqrt(bx * bx + by * by)
                if b == m or to_b > REACH or ax * bx + ay * by >= 0:
                    continue
                x, y = bx - ax, by - ay
                straight = math.sqrt(x * x + y * y)
                bent = (to_a + to_b - straight) / DETOUR
                if bent >= 1:
                    continue
                vx = (state[a, 2] + state[m, 2] + state[b, 2]) / 3
                vy = (state[a, 3] + state[m, 3] + state[b, 3]) / 3
                across, unlike = (vx * y - vy * x) / (straight * ACROSS), 0.0
                for k in (a, m, b):
                    unlike += ((state[k, 2] - vx) ** 2 + (state[k, 3] - vy) ** 2) / (3 * UNLIKE**2)
                value = (1 - bent) * math.exp(-(across * across + unlike) / 2)
                for k, other in ((a, b), (a, m), (m, b)):
                    if value > out[k, other]:
                        out[k, other] = out[other, k] = value


@njit(cache=True)
def lines(state: Array, out: Array) -> None:
    """Write `lines_of` all particles, (N_x, K, K); state (N_x, K, 4)."""
    for i in range(len(state)):
        lines_of(state[i], out[i])


@njit(cache=True)
def line_of(state: Array, line: Array, cluster: Ints, g: int, h: int) -> float:
    """Return how much clusters g and h together are a line, 0 to 1; h = g for one cluster.

    state (K, 4); line (K, K): as `lines_of`; cluster (K,). One person: 0. Two: `line`. More: max(0, 1 - s^2 / FLAT^2)
    exp(-(v / ACROSS)^2 / 2), with s^2 the variance of the places across the best line, and v the part of the mean
    velocity across it.
    """
    n, first, second = 0, -1, -1
    x = y = vx = vy = 0.0
    for k in range(len(cluster)):
        if cluster[k] == g or cluster[k] == h:
            first, second = second, k
            n += 1
            x += state[k, 0]
            y += state[k, 1]
            vx += state[k, 2]
            vy += state[k, 3]
    if n < 3:
        return float(line[first, second]) if n == 2 else 0.0
    xx = xy = yy = 0.0
    for k in range(len(cluster)):
        if cluster[k] == g or cluster[k] == h:
            dx, dy = state[k, 0] - x / n, state[k, 1] - y / n
            xx += dx * dx / n
            xy += dx * dy / n
            yy += dy * dy / n
    root = math.sqrt((xx - yy) ** 2 / 4 + xy * xy)
    variance = (xx + yy) / 2 - root
    if variance >= FLAT**2:
        return 0.0
    angle = math.atan2(2 * xy, xx - yy) / 2
    across = (vy * math.cos(angle) - vx * math.sin(angle)) / (n * ACROSS)
    return (1 - max(variance, 0.0) / FLAT**2) * math.exp(-across * across / 2)


@njit(cache=True)
def people_in_lines(state: Array, line: Array, label: Ints, out: Array) -> None:
    """Write the number of people in groups that are lines, for each partition, (N_x, N_z); a group counts by `line_of`.

    state (N_x, K, 4); line (N_x, K, K): as `lines`; label (N_x, N_z, K).
    """
    particles, partitions, n = label.shape
    cluster, head, size = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n)
    for i in range(particles):
        total = 0.0
        for j in range(partitions):
            if j == 0 or not same_row(label[i, j], label[i, j - 1]):
                count = clusters(label[i, j], cluster, head)
                size[:] = 0.0
                for k in range(n):
                    size[cluster[k]] += 1
                total = 0.0
                for g in range(count):
                    if size[g] > 1:
                        total += size[g] * line_of(state[i], line[i], cluster, g, g)
            out[i, j] = total
