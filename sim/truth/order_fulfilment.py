"""Did the script's orders come true? Asked of the finished truth; the measurement itself never sees an order.

An order is fulfilled by a measured event of its kind, with the right people, whose stretch starts no earlier than the
order's firing and whose rule has come true within 10 s of it (the 2 or 3 s of the rule included).
"""

from __future__ import annotations

import numpy as np

from scenarios.errors import WorkError
from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_DISTANCE, SPLIT_VELOCITY
from sim.truth.queue_detection import QUEUE_PEOPLE, QUEUE_TIME, WAITING_SPEED, detect_queues
from sim.truth.queue_shapes import MAX_SPACING, MIN_SPACING
from sim.types import Array, Bools, GroupEvent, Ints, Motion, Order, Truth

PATIENCE = 10.0  # s from the firing until the rule has come true
RULE_TIME = {"merge": HOLD_TIME, "split": HOLD_TIME, "queue": QUEUE_TIME}
KINDS = {"merge": ("merge", "form"), "split": ("split", "dissolve"), "queue": ("queue",)}
WORDS = {
    "merge": f"nearest members < {MERGE_DISTANCE:g} m and velocities differing < {MERGE_VELOCITY:g} m/s "
    f"for {HOLD_TIME:g} s",
    "split": f"nearest members of the parts > {SPLIT_DISTANCE:g} m, or > {MERGE_DISTANCE:g} m with velocities "
    f"differing > {SPLIT_VELOCITY:g} m/s, for {HOLD_TIME:g} s",
    "queue": f"{QUEUE_PEOPLE} people in order, {MIN_SPACING:g} to {MAX_SPACING:g} m apart, < {WAITING_SPEED:g} m/s, "
    f"for {QUEUE_TIME:g} s",
}


def check_orders(motion: Motion, truth: Truth) -> dict[str, int]:
    """The index in `truth.events` of the event that fulfils each order; WorkError for the first that none does."""
    group = dense_groups(truth, motion.present.shape)
    fulfilled = {}
    for order in motion.orders:
        index = fulfilment(order, truth, group)
        if index is None:
            raise _unfulfilled(order, motion, truth.length)
        fulfilled[order.id] = index
        if order.kind == "queue":
            _check_turns(order, motion, (truth.events or ())[index])
    return fulfilled


def _check_turns(order: Order, motion: Motion, event: GroupEvent) -> None:
    """WorkError where people left the queue of an order in another order than they stood: first in, first out."""
    for line in detect_queues(motion.pos, motion.vel, motion.present, motion.fps):
        people = {p + 1 for p in line.order}
        if (line.first + 1, line.last + 1) == (event.start, event.end) and people == set(event.members):
            if not line.fifo:
                raise WorkError(
                    file=f"scenario {motion.name}", place=f"event {order.id} (seed {motion.seed})",
                    got=f"a queue left by people {', '.join(str(p + 1) for p in line.left)} in this order",
                    expected=f"first in, first out: {', '.join(str(p + 1) for p in line.order)} or from the other end",
                    remedy="give the line more room, or let people come from behind it",
                )  # fmt: skip
            return


def dense_groups(truth: Truth, shape: tuple[int, ...]) -> Ints:
    """Group of each person in each frame (T, P): -1 alone, -2 absent."""
    group = np.full(shape, -2, np.int64)
    group[truth.frame - 1, truth.id - 1] = truth.group
    return group


def fulfilment(order: Order, truth: Truth, group: Ints) -> int | None:
    """The first event that fulfils the order; group (T, P) as dense_groups gives it."""
    if order.fired is None:
        return None
    last = order.fired + (PATIENCE - RULE_TIME[order.kind]) * truth.fps
    for k, event in enumerate(truth.events or ()):
        if event.kind in KINDS[order.kind] and order.fired <= event.start <= last and _concerns(event, order, group):
            return k
    return None


def _concerns(event: GroupEvent, order: Order, group: Ints) -> bool:
    """Whether this event brings about what the order wants."""
    if order.kind == "queue":
        people = {p for part in order.before for p in part}
        return len(people & set(event.members)) >= min(QUEUE_PEOPLE, len(people))
    wanted = [np.array(part, dtype=np.int64) - 1 for part in order.after]
    done = _together if order.kind == "merge" else _apart
    people = {p for part in order.after for p in part}
    now, before = group[event.start - 1], group[max(event.start - 2, 0)]
    return bool(people & set(event.members)) and done(wanted, now) and not done(wanted, before)


def _together(wanted: list[Ints], group: Ints) -> bool:
    """All people of each part in one group."""
    return all(group[w[0]] >= 0 and bool((group[w] == group[w[0]]).all()) for w in wanted if len(w) > 1)


def _apart(wanted: list[Ints], group: Ints) -> bool:
    """No group holds people of two parts."""
    held = [set(group[w][group[w] >= 0].tolist()) for w in wanted]
    return sum(map(len, held)) == len(set().union(*held))


def _unfulfilled(order: Order, motion: Motion, length: int) -> WorkError:
    place = f"event {order.id} (seed {motion.seed})"
    if order.fired is None:
        return WorkError(
            file=f"scenario {motion.name}", place=place, got=f"a {order.kind} that never fired",
            expected=f"its trigger within the {length / motion.fps:g} s recorded",
            remedy="loosen its `when`, or let the groups come closer",
        )  # fmt: skip
    end = min(length, order.fired + round(PATIENCE * motion.fps))
    window = slice(max(order.fired, 1) - 1, end)
    short = (end - order.fired) / motion.fps
    limit = f"{PATIENCE:g} s" if short >= PATIENCE - 1e-9 else f"the {max(short, 0):.1f} s until the recording ends"
    return WorkError(
        file=f"scenario {motion.name}", place=place,
        got=f"no such {order.kind} within {limit} of its firing: {closest(order, motion, window)}",
        expected=WORDS[order.kind], remedy="move starts and goals, fire it earlier, or record for longer",
    )  # fmt: skip


def closest(order: Order, motion: Motion, window: slice) -> str:
    """The values that came nearest to the rule, in words."""
    pos, vel, present = motion.pos[window], motion.vel[window], motion.present[window]
    if not len(pos):
        return "the recording had ended"
    if order.kind == "queue":
        people = [p - 1 for part in order.before for p in part]
        slow = present[:, people] & (np.linalg.norm(np.nan_to_num(vel[:, people]), axis=2) < WAITING_SPEED)
        most, stretch = slow.sum(axis=1).max(initial=0), _longest(slow.sum(axis=1) >= QUEUE_PEOPLE) / motion.fps
        return (
            f"at most {most} of {len(people)} people slower than {WAITING_SPEED:g} m/s at once, "
            f"{QUEUE_PEOPLE} of them for {stretch:.1f} s at a stretch"
        )
    parts = order.before if order.kind == "merge" else order.after
    columns = [np.array(part, dtype=np.int64) - 1 for part in parts]
    gap, difference = _gaps(columns, pos, vel, present, widest=order.kind == "merge")
    if not np.isfinite(gap).any():
        return "the parts were never there together"
    k = int(np.nanargmin(gap) if order.kind == "merge" else np.nanargmax(gap))
    word = "nearest" if order.kind == "merge" else "furthest"
    return f"{word} {gap[k]:.2f} m, velocities then differing by {difference[k]:.2f} m/s"


def _longest(holds: Bools) -> int:
    """Frames of the longest stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _gaps(columns: list[Ints], pos: Array, vel: Array, present: Bools, widest: bool) -> tuple[Array, Array]:
    """Per frame (T,): distance of nearest members and velocity difference between one part and the rest, nan if absent.

    Of more than two parts, the one that lags behind: the widest gap (it has to close) or the narrowest (to open).
    """
    gaps, differences = [], []
    for i, a in enumerate(columns):
        rest = np.concatenate([c for j, c in enumerate(columns) if j != i]) if len(columns) > 1 else a[:0]
        d = np.linalg.norm(pos[:, a, None] - pos[:, None, rest], axis=3)
        gaps.append(np.where(np.isnan(d), np.inf, d).reshape(len(pos), -1).min(axis=1, initial=np.inf))
        differences.append(np.linalg.norm(_mean_velocity(vel, present, a) - _mean_velocity(vel, present, rest), axis=1))
    gap, difference = np.array(gaps), np.array(differences)
    gap[np.isinf(gap)] = -np.inf if widest else np.inf
    worst = gap.argmax(axis=0) if widest else gap.argmin(axis=0), np.arange(len(pos))
    return np.where(np.isfinite(gap[worst]), gap[worst], np.nan), difference[worst]


def _mean_velocity(vel: Array, present: Bools, columns: Ints) -> Array:
    n = present[:, columns].sum(axis=1)[:, None]
    total = np.where(present[:, columns, None], vel[:, columns], 0.0).sum(axis=1)
    return np.where(n > 0, total / np.maximum(n, 1), np.nan)
