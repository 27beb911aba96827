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
from sim.io.files.numeric_text import read_text
from sim.io.files.tables import json_list, nan_to_none, none_to_nan, read_document
from sim.types import EVENT_KINDS, GroupEvent, Near, Order

NEAR_COLUMNS = "start,end,a,b"


def event_dict(event: GroupEvent) -> dict[str, Any]:
    """Return an event as a dict for JSON, with the fields of GroupEvent as keys.

    Keys: kind, start and end (frames from 1, inclusive), emitted (frame in which a tracker reported it, None in a
    truth), before and after (lists of group ids, -1 for a person alone), members (list of person ids), pos [x, y].
    Unknown (nan) coordinates of `pos` are None.
    """
    return {
        "kind": event.kind, "start": int(event.start), "end": int(event.end),
        "emitted": None if event.emitted is None else int(event.emitted),
        "before": [int(g) for g in event.before], "after": [int(g) for g in event.after],
        "members": [int(m) for m in event.members], "pos": [nan_to_none(float(v)) for v in event.pos],
    }  # fmt: skip


def events_bytes(events: Iterable[GroupEvent]) -> bytes:
    """Return the events.json of a truth, as bytes, with one event per line in the given order; no events give an empty
    list.

    It is the JSON object {"format": 1, "events": [...]}. Raises ValueError for an infinite coordinate.
    """
    return json_list("events", map(event_dict, events))


def read_events(path: Path) -> list[tuple[GroupEvent, int | None]]:
    """Read an events.json as pairs (event, frame whose tracks reported it), in the order of the file.

    The frame counts from 1 and is None if the file does not store it, as in a truth. Null coordinates become nan.
    Raises InputError if the file is unreadable, no JSON object, of another format number or without a list of events.
    Also raises InputError if an event lacks a key, has an unknown kind or a value of the wrong type, starts before
    frame 1 or ends before it starts.
    """
    found = read_document(path).get("events")
    if not isinstance(found, list):
        raise InputError(file=path, place="events", got=type(found).__name__, expected="a list", remedy="correct it")
    return [(_event(path, k, e), _frame(path, k, e)) for k, e in enumerate(found)]


def _frame(path: Path, k: int, e: dict[str, Any]) -> int | None:
    try:
        return None if e.get("frame") is None else _whole(e["frame"])
    except TypeError as error:
        raise _bad(path, k, f"frame {error}", "a frame, or null") from None


def _event(path: Path, k: int, e: Any) -> GroupEvent:
    try:
        event = GroupEvent(
            str(e["kind"]), _whole(e["start"]), _whole(e["end"]),
            None if e["emitted"] is None else _whole(e["emitted"]),
            tuple(map(_whole, e["before"])), tuple(map(_whole, e["after"])), tuple(map(_whole, e["members"])),
            (none_to_nan(e["pos"][0]), none_to_nan(e["pos"][1])),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise _bad(path, k, f"{type(error).__name__} {error}", "an event with all its keys") from None
    if event.kind not in EVENT_KINDS:
        raise _bad(path, k, repr(event.kind), f"a kind out of {', '.join(EVENT_KINDS)}")
    if not 1 <= event.start <= event.end:
        raise _bad(path, k, f"frames {event.start} to {event.end}", "frames from 1, start not after end")
    return event


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{value!r} is no whole number")
    return value


def _bad(path: Path, k: int, got: str, expected: str) -> InputError:
    return InputError(file=path, place=f"events[{k}]", got=got, expected=expected, remedy="correct the event")


def near_bytes(near: Near) -> bytes:
    """Return near.csv as bytes: a header and the columns start, end (frames from 1, inclusive), a, b (person ids).

    A row is a pair of strangers who satisfy the merge rule. No rows give the header alone.
    """
    rows = zip(near.start, near.end, near.a, near.b, strict=True)
    return "".join([NEAR_COLUMNS + "\n", *(f"{s},{e},{a},{b}\n" for s, e, a, b in rows)]).encode()


def read_near(path: Path) -> Near:
    """Read a near.csv (frames start, end and person ids a, b); a file with the header alone gives no rows.

    A row is a pair of strangers who satisfy the merge rule from frame start to end (from 1, inclusive). Raises
    InputError if the file is unreadable, its header is another one, a cell is no integer, or lines differ in length or
    have not four cells; eight cells in every line count as two rows. Raises OverflowError for an integer beyond 64
    bits. Ranges are not checked.
    """
    lines = read_text(path).splitlines()
    if lines[:1] != [NEAR_COLUMNS]:
        raise InputError(
            file=path, place="line 1", got="".join(lines[:1])[:80], expected=NEAR_COLUMNS, remedy="restore the header"
        )
    if len(lines) == 1:
        return Near.none()
    try:
        table = np.array([[int(c) for c in line.split(",")] for line in lines[1:]], np.int64).reshape(-1, 4)
    except ValueError as error:
        raise InputError(file=path, got=str(error), expected="four whole numbers", remedy="restore it") from None
    return Near(*(table[:, k].copy() for k in range(4)))


def script_bytes(orders: Iterable[Order], fulfilled: Iterable[int | None]) -> bytes:
    """Return script.json as bytes, with one order of the script per line; no orders give an empty list.

    orders: the script's orders. fulfilled: for each order the index (from 0) in events.json of the event that fulfilled
    it, or None; stored as the key "event". The other keys are id, kind, fired (frame from 1, or null), before, after
    (lists of person ids of each group). Raises ValueError if the two differ in length.
    """
    rows = (
        {"id": o.id, "kind": o.kind, "fired": o.fired, "before": o.before, "after": o.after, "event": event}
        for o, event in zip(orders, fulfilled, strict=True)
    )
    return json_list("orders", rows)


def read_script(path: Path) -> tuple[Order, ...]:
    """Read the orders of a script.json, in the order of the file; the key "event" is ignored, a missing list gives ().

    Raises InputError if the file is unreadable, no JSON object or of another format number, if "orders" is no list, or
    if an order lacks a key or has a person id that is no integer. The frame "fired" is not checked.
    """
    found = read_document(path).get("orders")
    try:
        return tuple(
            Order(str(o["id"]), str(o["kind"]), o["fired"], _people(o["before"]), _people(o["after"]))
            for o in found or ()
        )
    except (KeyError, TypeError) as error:
        raise InputError(
            file=path, got=f"{type(error).__name__} {error}", expected="orders with all their keys", remedy="restore it"
        ) from None


def _people(groups: Any) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(_whole(p) for p in group) for group in groups)
