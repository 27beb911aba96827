"""Checks whether the orders of the script came true, from the finished truth, which is measured without the orders.

An order (merge, split or queue) is fulfilled by a measured event of its kind, with the right people, that starts no
earlier than the order fired. The event's rule must have held for its whole time (2 s; queues 3 s) within PATIENCE (10
s) of the firing. Orders are carried out by sim.crowd.order_execution.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenarios.errors import OrderError
from sim.elementary import length

# isort: off
# fmt: off
from sim.truth.merge_split_rules import (
    HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_DISTANCE, SPLIT_VELOCITY, longest_time, separation,
)
from sim.truth.queue_detection import (
    ADVANCE_TIME, MAX_SPACING, MIN_SPACING, QUEUE_PEOPLE, QUEUE_TIME, WAITING_SPEED, longest_line, queues,
)
# fmt: on
# isort: on
from sim.truth.motion_rows import MotionRows
from sim.types import Array, GroupEvent, Ints, Motion, Order, States, Truth

PATIENCE = 10.0  # s from the firing of an order until its rule has come true
# s for which the rule of each kind of order must hold
RULE_TIME = {"merge": HOLD_TIME, "split": HOLD_TIME, "queue": QUEUE_TIME}
# kinds of events that fulfil each kind of order
KINDS = {"merge": ("merge", "form"), "split": ("split", "dissolve"), "queue": ("queue",)}
WORDS = {
    "merge": f"parts < {MERGE_DISTANCE:g} m apart, velocities differing < {MERGE_VELOCITY:g} m/s, for {HOLD_TIME:g} s",
    "split": f"parts > {SPLIT_DISTANCE:g} m apart, or > {MERGE_DISTANCE:g} m with velocities differing "
    f"> {SPLIT_VELOCITY:g} m/s, for {HOLD_TIME:g} s",
    "queue": f"{QUEUE_PEOPLE} people in line, {MIN_SPACING:g} to {MAX_SPACING:g} m apart, < {WAITING_SPEED:g} m/s, "
    f"for {QUEUE_TIME:g} s",
}


def check_orders(motion: Motion, truth: Truth) -> None:
    """Raises OrderError for the first order of `truth` that no event fulfils. motion: for the message."""
    for order in truth.orders:
        if order.event is None:
            raise _unfulfilled(order, motion, truth)


def _fired(order: Order, s: States) -> int:
    assert order.time is not None
    return round(order.time * s.rate)


def fulfilment(order: Order, events: Sequence[GroupEvent], group: Ints, s: States) -> int | None:
    """Returns the index of the first event that fulfils an order, None if no event does.

    events: with ticks of the states (from 1) in place of frames. group (C, P): ids at each tick, -1 = alone or absent.
    """
    if order.time is None:
        return None
    first = _fired(order, s) + 1
    last = first + (PATIENCE - RULE_TIME[order.kind]) * s.rate
    for k, event in enumerate(events):
        if event.kind in KINDS[order.kind] and first <= event.start <= last and _concerns(event, order, group):
            return k
    return None


def queued(people: set[int], states: Array, rate: float) -> bool:
    """Returns True if these people (ids) have made a queue in the states (T, P, 4): x, y, vx, vy, nan while absent."""
    pos, vel, present = states[..., :2], states[..., 2:], np.isfinite(states[..., 0])
    rows = MotionRows.of_table(pos, vel, present, np.full(present.shape, -1))
    return any(_is_queue_of(people, event) for event in queues(rows, rate))


def _is_queue_of(people: set[int], event: GroupEvent) -> bool:
    return len(people & set(event.members)) >= min(QUEUE_PEOPLE, len(people))


def _concerns(event: GroupEvent, order: Order, group: Ints) -> bool:
    """Returns True if an event of the right kind and time has the people and the effect that the order asks for."""
    if order.kind == "queue":
        return _is_queue_of({p for part in order.before for p in part}, event)
    wanted = [np.array(part, dtype=np.int64) - 1 for part in order.after]
    done = _together if order.kind == "merge" else _apart
    people = {p for part in order.after for p in part}
    # The effect must come with the event: it is there at its first tick, and not before.
    now, before = group[event.start - 1], group[max(event.start - 2, 0)]
    return bool(people & set(event.members)) and done(wanted, now) and not done(wanted, before)


def _together(wanted: list[Ints], group: Ints) -> bool:
    """Returns True if the people (columns) of each part are in one group (P,) in one frame."""
    return all(group[w[0]] >= 0 and bool((group[w] == group[w[0]]).all()) for w in wanted if len(w) > 1)


def _apart(wanted: list[Ints], group: Ints) -> bool:
    """Returns True if no group has people of two parts."""
    ids = [set(group[w][group[w] >= 0].tolist()) for w in wanted]
    return sum(map(len, ids)) == len(set().union(*ids))


def _unfulfilled(order: Order, motion: Motion, truth: Truth) -> OrderError:
    s = motion.states()
    length = len(s.present)
    if order.time is None:
        why = dict(motion.unfired).get(order.id)
        got = f"a {order.kind} that never fired" + (f": {why}" if why else "")
        expected = f"its trigger within the {length / s.rate:g} s recorded"
        remedy = "loosen its `when`, or let the groups come closer"
    else:
        fired = _fired(order, s)
        end = min(length, fired + 1 + round(PATIENCE * s.rate))
        until = "when the recording ended" if end == length else f"at {(end - 1) / s.rate:g} s"
        got = f"a {order.kind} that fired at {order.time:g} s and had not come true {until}: "
        got += closest(order, s, slice(fired, end))
        expected, remedy = (
            f"{WORDS[order.kind]}, within {PATIENCE:g} s",
            "move starts and goals, fire it earlier, or record for longer",
        )
        since = [(e.start - 1) / truth.fps for e in truth.events or () if _stood_before(order, e, truth.fps)]
        if since:
            got += f"; the queue in which they stand began before, at {since[0]:g} s"
            expected, remedy = "a queue that begins after it", f"let people walk for more than {ADVANCE_TIME:g} s to it"
    place = f"event {order.id} (seed {motion.seed})"
    return OrderError(file=f"scenario {motion.name}", place=place, got=got, expected=expected, remedy=remedy)


def _stood_before(order: Order, event: GroupEvent, fps: float) -> bool:
    """Returns True if an event is a queue of an order's people that began before the order fired, and went on."""
    people = {p for part in order.before for p in part}
    concerns = order.kind == event.kind == "queue" and _is_queue_of(people, event)
    return concerns and order.time is not None and (event.start - 1) / fps < order.time < (event.end - 1) / fps


def closest(order: Order, s: States, window: slice) -> str:
    """Returns a phrase for messages: how nearly an order's rule was met within `window`, a slice of ticks."""
    pos, vel = s.pos[window], s.vel[window]
    if order.kind == "queue":
        people = [p - 1 for part in order.before for p in part]
        there, intent = s.present[window][:, people], s.intent[window][:, people]
        slow = there & (length(np.nan_to_num(vel[:, people])) < WAITING_SPEED)
        most = slow.sum(axis=1).max(initial=0)
        line, time = longest_line(MotionRows.of_table(pos[:, people], vel[:, people], there, intent), s.rate)
        words = f"at most {most} of {len(people)} people slower than {WAITING_SPEED:g} m/s at once"
        return f"{words}, a line of {line} people for {time:g} s" if line else f"{words}, no two of them in line"
    first, *others = (np.array(p, np.int64) - 1 for p in (order.before if order.kind == "merge" else order.after))
    found = separation(pos, vel, first, np.concatenate(others))
    gap = np.where(np.isfinite(found.distance), found.distance, np.nan)
    if not np.isfinite(gap).any():
        return "the parts were never there together"
    word, k = ("nearest", np.nanargmin(gap)) if order.kind == "merge" else ("furthest", np.nanargmax(gap))
    difference = found.velocity_difference[k]
    held = found.merge_rule() if order.kind == "merge" else found.split_rule()
    time = longest_time(held, s.rate)
    words = f"parts {word} {gap[k]:.2f} m apart, velocities then differing by {difference:.2f} m/s"
    return f"{words}; both fit for {time:g} s at most"
