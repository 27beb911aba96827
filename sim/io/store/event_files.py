"""Small files of a sequence's truth, to bytes and back.

events.json: group events. near.csv: hard negatives, that is pairs of people who satisfy the merge rule but are
strangers; frames from 1. script.json: the orders of the scenario's script.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, FRAMES, is_number
from sim.io.files.numeric_text import read_text, whole_number
from sim.io.files.tables import json_list, nan_to_none, read_document
from sim.types import EVENT_KINDS, GroupEvent, Near, Order

NEAR_COLUMNS = "start,end,a,b"
ORDER_KEYS = ("id", "kind", "fired", "time", "before", "after", "event")


def event_dict(event: GroupEvent) -> dict[str, Any]:
    """Returns an event as a dict for JSON, with the fields of GroupEvent as keys."""
    return {
        "kind": event.kind, "start": int(event.start), "end": int(event.end),
        "emitted": None if event.emitted is None else int(event.emitted),
        "before": [int(g) for g in event.before], "after": [int(g) for g in event.after],
        "members": [int(m) for m in event.members], "pos": [nan_to_none(float(v)) for v in event.pos],
    }  # fmt: skip


def events_bytes(events: Iterable[GroupEvent]) -> bytes:
    """Returns the events.json of a truth, one event per line."""
    return json_list("events", map(event_dict, events))


def read_events(path: Path) -> list[tuple[GroupEvent, int | None]]:
    """Reads an events.json as pairs (event, frame whose tracks reported it, None if not stored)."""
    found = read_document(path).get("events")
    if not isinstance(found, list):
        raise InputError(file=path, place="events", got=type(found).__name__, expected="a list", remedy="correct it")
    return [(_event(path, k, e), _frame(path, k, e)) for k, e in enumerate(found)]


def _frame(path: Path, k: int, e: dict[str, Any]) -> int | None:
    try:
        return None if e.get("frame") is None else _number_from(1, e["frame"])
    except (TypeError, ValueError) as error:
        raise _bad(path, k, f"frame {error}", "a frame, or null") from None


def _event(path: Path, k: int, e: Any) -> GroupEvent:
    try:
        x, y = (_coordinate(v) for v in e["pos"])
        event = GroupEvent(
            str(e["kind"]), _number_from(1, e["start"]), _number_from(1, e["end"]),
            None if e["emitted"] is None else _number_from(1, e["emitted"]),
            _numbers_from(-1, e["before"]), _numbers_from(-1, e["after"]), _numbers_from(0, e["members"]), (x, y),
        )  # fmt: skip
    except KeyError as error:
        raise _bad(path, k, f"no key {error}", "an event with all its keys") from None
    except (TypeError, ValueError) as error:
        raise _bad(path, k, str(error), "whole numbers as frames and ids, and pos [x, y]") from None
    if event.kind not in EVENT_KINDS:
        raise _bad(path, k, repr(event.kind), f"a kind out of {', '.join(EVENT_KINDS)}")
    if not event.start <= event.end <= FRAMES:
        expected = f"frames from 1 to {FRAMES}, start not after end"
        raise _bad(path, k, f"frames {event.start} to {event.end}", expected)
    return event


def _number_from(least: int, value: Any) -> int:
    # True is no number.
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ValueError(f"{value!r}, which is no whole number from {least} on")
    return value


def _numbers_from(least: int, values: Any) -> tuple[int, ...]:
    if not isinstance(values, list):
        raise ValueError(f"{values!r}, which is no list")
    return tuple(_number_from(least, value) for value in values)


def _coordinate(value: Any) -> float:
    if value is None:
        return float("nan")
    if not is_number(value, -COORDINATE, COORDINATE):
        raise ValueError(f"{value!r}, which is no coordinate within {COORDINATE:g}")
    return float(value)


def _bad(path: Path, k: int, got: str, expected: str) -> InputError:
    return InputError(file=path, place=f"events[{k}]", got=got, expected=expected, remedy="correct the event")


def near_bytes(near: Near) -> bytes:
    """Returns near.csv: start, end (frames from 1, inclusive), a, b (ids of strangers who satisfy the merge rule)."""
    rows = zip(near.start, near.end, near.a, near.b, strict=True)
    return "".join([NEAR_COLUMNS + "\n", *(f"{s},{e},{a},{b}\n" for s, e, a, b in rows)]).encode()


def read_near(path: Path) -> Near:
    """Reads a near.csv."""
    header, *lines = read_text(path).splitlines() or [""]
    if header != NEAR_COLUMNS:
        raise InputError(
            file=path, place="line 1", got=repr(header), expected=NEAR_COLUMNS, remedy="restore the header"
        )
    rows = [_near_row(path, k, line) for k, line in enumerate(lines, 2)]
    return Near(*np.array(rows, np.int64).reshape(-1, 4).T.copy()) if rows else Near.none()


def _near_row(path: Path, number: int, line: str) -> tuple[int, int, int, int]:
    try:
        start, end, a, b = (whole_number(cell) for cell in line.split(","))
    except ValueError:
        start, end, a, b = 0, 0, -1, -1
    if not 1 <= start <= end <= FRAMES or min(a, b) < 0:
        expected = f"frames from 1 to {FRAMES}, start not after end, and two ids from 0 on"
        raise InputError(file=path, place=f"line {number}", got=repr(line), expected=expected, remedy="restore it")
    return start, end, a, b


def script_bytes(orders: Iterable[Order]) -> bytes:
    """Returns script.json, one order of the script per line."""
    return json_list("orders", ({key: getattr(o, key) for key in ORDER_KEYS} for o in orders))


def read_script(path: Path) -> tuple[Order, ...]:
    """Reads the orders of a script.json; a missing list gives none."""
    found = read_document(path).get("orders", [])
    if not isinstance(found, list):
        raise InputError(file=path, place="orders", got=type(found).__name__, expected="a list", remedy="restore it")
    return tuple(_order(path, k, order) for k, order in enumerate(found))


def _order(path: Path, k: int, o: Any) -> Order:
    try:
        fired = None if o["fired"] is None else _number_from(1, o["fired"])
        time, event = o.get("time"), o.get("event")
        if time is not None and not is_number(time, 0, COORDINATE):
            raise ValueError(f"time {time!r}, which is no time in s")
        event = None if event is None else _number_from(0, event)
        return Order(str(o["id"]), str(o["kind"]), fired, _people(o["before"]), _people(o["after"]), time, event)
    except (KeyError, TypeError, ValueError) as error:
        got = f"no key {error}" if isinstance(error, KeyError) else str(error)
        expected = "an order with id, kind, fired, before and after"
        raise InputError(file=path, place=f"orders[{k}]", got=got, expected=expected, remedy="restore it") from None


def _people(groups: Any) -> tuple[tuple[int, ...], ...]:
    if not isinstance(groups, list):
        raise ValueError(f"{groups!r}, which is no list")
    return tuple(_numbers_from(0, group) for group in groups)
