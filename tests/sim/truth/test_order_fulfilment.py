from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import WorkError
from sim.truth.order_fulfilment import check_orders, fulfilment
from sim.types import GroupEvent, Motion, Order, Truth
from tests.reference_sense import walkers

FRAMES = 150


def order_of(id: str, kind: str, fired: int | None, before: tuple, after: tuple) -> Order:
    """An order that fired in a frame of 0.1 s."""
    return Order(id, kind, fired, before, after, None if fired is None else (fired - 1) / 10)


def check(motion: Motion, truth: Truth) -> dict[str, int]:
    """Checks the orders of a motion against the events and groups of a truth of the same frames."""
    group = np.full(motion.present.shape, -1)
    column = truth.id <= group.shape[1]
    group[truth.frame[column] - 1, truth.id[column] - 1] = truth.group[column]
    found = [fulfilment(o, truth.events or (), group, motion.states()) for o in motion.orders]
    orders = tuple(replace(o, event=k) for o, k in zip(motion.orders, found, strict=True))
    check_orders(motion, truth.replace(orders=orders))
    return {order.id: order.event for order in orders}


def merging(fired: int | None = 20, kind: str = "merge") -> Motion:
    """Persons 1 and 2 in one group, 3 in another, one order that the three belong together."""
    order = order_of("m1", kind, fired, ((1, 2), (3,)), ((1, 2, 3),))
    start = [[2, 2], [2.8, 2], [12, 2]]
    return walkers(start, [[0.5, 0], [0.5, 0], [-0.2, 0]], frames=FRAMES, orders=(order,))


def truth_of(motion: Motion, changes: int, kind: str = "merge", to: tuple[int, ...] = (1, 1, 1)) -> Truth:
    """A truth in which the groups change once, in frame `changes`, with an event of this kind."""
    frame = np.repeat(np.arange(1, FRAMES + 1), 3)
    person = np.tile([1, 2, 3], FRAMES)
    group = np.where(frame >= changes, np.tile(to, FRAMES), np.tile([1, 1, -1], FRAMES))
    event = GroupEvent(kind, changes, changes, None, (-1, 1), (1,), (1, 2, 3), (0.0, 0.0))
    return Truth(
        "made-up", 10.0, FRAMES, 40.0, frame, person, group, None, None, None, np.ones(len(frame)), events=(event,)
    )


@pytest.mark.parametrize("onset", [20, 57, 100])
def test_fulfilled_from_the_firing_to_ten_seconds_less_the_rule(onset: int) -> None:
    motion = merging()
    assert check(motion, truth_of(motion, onset)) == {"m1": 0}


@pytest.mark.parametrize("onset", [19, 101])
def test_too_early_and_too_late(onset: int) -> None:
    motion = merging()
    with pytest.raises(WorkError) as caught:
        check(motion, truth_of(motion, onset))
    assert caught.value.file == "scenario made-up"
    assert "m1" in caught.value.place
    assert "seed 7" in caught.value.place
    assert "within 10 s" in caught.value.expected
    assert "fired at 1.9 s and had not come true at 11.9 s: parts nearest" in caught.value.got
    assert "1.5 m" in caught.value.expected


def test_the_wrong_kind_or_the_wrong_people_do_not_count() -> None:
    motion = merging()
    with pytest.raises(WorkError):
        check(motion, truth_of(motion, 50, kind="cross"))
    with pytest.raises(WorkError):
        check(motion, truth_of(motion, 50, to=(1, 1, -1)))
    assert check(motion, truth_of(motion, 50, kind="form")) == {"m1": 0}
    assert check(motion, truth_of(motion, 50, to=(0, 0, 0))) == {"m1": 0}, "0 is the id of a group"


def test_an_order_that_never_fired() -> None:
    with pytest.raises(WorkError, match="never fired"):
        check(merging(None), truth_of(merging(None), 50))


def test_the_reason_for_never_firing_is_named() -> None:
    motion = merging(None).replace(unfired=(("m1", "its groups came within 3.20 m"),))
    with pytest.raises(WorkError, match=r"never fired: its groups came within 3\.20 m;"):
        check(motion, truth_of(motion, 50))


def test_the_time_for_which_a_merge_fitted_is_named() -> None:
    motion = merging()
    vel = motion.vel.copy()
    vel[60:73] = 0
    near = motion.pos.copy()
    near[:, 2] = near[:, 1] + [1.0, 0]
    with pytest.raises(WorkError, match=r"both fit for 1\.3 s"):
        check(motion.replace(pos=near, vel=vel), truth_of(motion, 138))


def test_splits() -> None:
    order = order_of("s1", "split", 20, ((1, 2),), ((1,), (2,)))
    motion = merging().replace(orders=(order,))
    assert check(motion, truth_of(motion, 50, "split", (-1, -1, -1))) == {"s1": 0}
    assert check(motion, truth_of(motion, 50, "dissolve", (-1, -1, -1))) == {"s1": 0}
    with pytest.raises(WorkError, match=r"furthest 0\.80 m"):
        check(motion, truth_of(motion, 50, "split", (1, 1, -1)))


def test_queues_want_three_of_their_people() -> None:
    order = order_of("q1", "queue", 20, ((1, 2), (3,)), ())
    motion = merging().replace(orders=(order,))
    truth = truth_of(motion, 50, "queue")
    assert check(motion, truth) == {"q1": 0}
    assert truth.events is not None
    fewer = truth.replace(events=(GroupEvent("queue", 50, 90, None, (), (), (1, 2, 9), (0, 0)),))
    with pytest.raises(WorkError, match="at most 1 of 3 people slower"):
        check(motion, fewer)
    pause = motion.vel.copy()
    pause[30:47] = 0
    with pytest.raises(WorkError, match="at most 3 of 3 "):
        check(motion.replace(vel=pause), fewer)
    with pytest.raises(WorkError, match=r"a line of 2 people for 1\.7 s"):
        check(motion.replace(vel=pause), fewer)
    before = truth.replace(events=(GroupEvent("queue", 11, 90, None, (), (), (1, 2, 3), (0, 0)),))
    with pytest.raises(WorkError, match=r"the queue in which they stand began before, at 1 s; .* more than 3 s"):
        check(motion, before)
    late = truth_of(motion, 128, "queue")  # 3 s of the rule would end later than 10 s and the way after the firing
    with pytest.raises(WorkError):
        check(motion, late)


def test_the_recording_may_end_first() -> None:
    motion = merging(140)
    with pytest.raises(WorkError, match="when the recording ended"):
        check(motion, truth_of(motion, 30))
