"""Draws a scenario as SVG, without simulating it: a plan, and beneath it the orders of the script in words.

The plan shows ground, walls, pillars and boxes, ways, starts and orders, as far as they are known before the
simulation. A distribution is replaced by its mean and the range of its draws. Where groups meet, and where a group
divides, is taken to be half-way.
"""

from __future__ import annotations

import io
import math
from typing import Any, NamedTuple

import numpy as np

from scenarios.drawing import words as describe
from scenarios.schema.geometry import cut_walls, queue_places
from scenarios.schema.groups import GroupSpec, group_names, parts_of
from scenarios.schema.scenario import MergeOrder, Scenario, ScriptOrder, SplitOrder, expand
from scenarios.schema.values import Distribution, Point, Value, bounds

XY = tuple[float, float]
Way = tuple[XY, ...]
SLOTS = 6  # greatest number of places of a queue that are drawn
SIZE = (9.0, 6.2)  # inches: of the plan
# Of groups: dark enough to read on white, and distinct for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#3d6fd6", "#b2182b", "#4d7c0f", "#6a51a3", "#5c5c5c")
DARK, GREY, PALE = "#1b1f24", "#57606a", "#8c959f"
STYLE: Any = {"svg.fonttype": "none", "svg.hashsalt": "flockscope", "font.size": 9, "text.parse_math": False}
CLEAR = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5}  # behind labels


class OrderMark(NamedTuple):
    """An order of the script as drawn on the plan."""

    at: XY  # x, y of where it happens, m
    ways: dict[str, Way]  # those it opens, by name of the group; empty if groups stay or keep their goals
    slots: Way = ()  # x, y of the places of a queue and its counters, m; empty for other orders


def middle(value: Value) -> float:
    """Returns a number itself, or the mean of a distribution; a mean outside `clip` becomes the nearer bound."""
    if not isinstance(value, Distribution):
        return float(value)
    drawn = value.normal[:1] if value.normal is not None else value.uniform or value.choice
    mean = float(np.mean(drawn)) if drawn else value.exponential or value.poisson or 0.0
    low, high = bounds(value)
    return min(max(mean, low), high)


def spread(value: Value) -> float:
    """Returns half the width of the range in which most draws of a value lie, for normal 2 sd; 0 for a number."""
    if not isinstance(value, Distribution):
        return 0.0
    low, high = bounds(value)
    usual = 2 * value.normal[1] if value.normal is not None else 2 * middle(value) if math.isinf(high) else math.inf
    return min((high - low) / 2, usual)


def _at(point: Point) -> XY:
    return middle(point[0]), middle(point[1])


def _mean(*points: XY) -> XY:
    x, y = np.mean(points, axis=0)
    return float(x), float(y)


def _mark(event: ScriptOrder, places: dict[str, tuple[XY, XY]], world: XY) -> OrderMark:
    """Returns an order as drawn, and changes the start and goal of its groups in `places`."""
    if isinstance(event, MergeOrder):
        at = _mean(*(_mean(*places.pop(name)) for name in event.groups))
        goal = at if isinstance(event.goal, str) else _at(event.goal)
        places[event.into] = (at, goal)
        return OrderMark(at, {} if goal == at else {event.into: (at, *map(_at, event.via), goal)})
    if isinstance(event, SplitOrder):
        at = _mean(*places.pop(event.group))
        ways = {part.id: (at, *map(_at, part.via), _at(part.goal)) for part in event.parts}
        places.update({name: (at, way[-1]) for name, way in ways.items()})
        return OrderMark(at, ways)
    inside = tuple((x, y) for x, y in queue_places(event, SLOTS) if 0 <= x <= world[0] and 0 <= y <= world[1])
    inside += event.counters or ()
    if event.goal is None:
        return OrderMark(event.at, {}, inside)
    way = event.at, _at(event.goal)
    names = [name for pattern in event.groups for name in expand(pattern, list(places))]
    places.update(dict.fromkeys(names, way))
    return OrderMark(event.at, {names[0]: way}, inside)


def svg(scenario: Scenario) -> str:
    """Returns an SVG drawing of a scenario: the plan with starts, ways and goals, and beneath it the orders."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    places = {name: (_at(group.start), _at(group.goal)) for group in scenario.group for name in group_names(group)}
    orders = [_mark(event, places, scenario.world.size) for event in scenario.event]
    script = [
        describe.cut(f"{k}  {event.id}: {describe.order(event)} — {describe.trigger(event.when)}", 128)
        for k, event in enumerate(scenario.event, 1)
    ]
    with rc_context(STYLE):
        figure, out = Figure(SIZE), io.StringIO()
        plan = figure.add_axes((0, 0, 1, 1))
        _draw_world(plan, scenario)
        _draw_ways(plan, scenario, orders)
        above: Any = {"xycoords": "axes fraction", "textcoords": "offset points"}
        plan.annotate(scenario.name, (0, 1), (0, 22), size=13, weight="bold", **above)
        plan.annotate(describe.cut(scenario.about, 140), (0, 1), (0, 8), **above)
        plan.set_xlabel("\n".join(["Script", *script]), loc="left", labelpad=20, linespacing=1.8)
        figure.savefig(out, format="svg", bbox_inches="tight", metadata={"Date": None})
    return out.getvalue()


def _label(axes: Any, at: XY, words: str, colour: str, up: float, **style: Any) -> None:
    style = {"color": colour, "weight": "bold", "ha": "center", "bbox": CLEAR, "textcoords": "offset points", **style}
    axes.annotate(words, at, (0, up), **style)


def _draw_world(axes: Any, scenario: Scenario) -> None:
    from matplotlib.patches import Circle, Rectangle

    world, (width, depth) = scenario.world, scenario.world.size
    step = 1.0 if width <= 40 else 5.0
    axes.set(xlim=(0, width), ylim=(0, depth), xticks=np.arange(0, width, step), yticks=np.arange(0, depth, step))
    axes.set(facecolor="#f6f8fa", axisbelow=True, aspect="equal")
    axes.tick_params(length=0, labelbottom=False, labelleft=False)
    axes.spines[:].set_color(PALE)
    axes.grid(color="#e3e7ec")
    _label(axes, (0, 0), f"{width:g} × {depth:g} m, a line each {step:g} m", GREY, -11, weight="normal", ha="left")
    for stairs in world.stairs:
        foot, head = np.array(stairs.foot), np.array(stairs.head)
        along = (head - foot) / math.dist(foot, head)
        side = np.array([[-along[1], along[0]], [along[1], -along[0]]]) * stairs.width / 2
        for end, colour in ((head + along * stairs.landing, "#eaeef2"), (head, "#d8dee4")):
            axes.fill(*np.concatenate([foot + side, (end + side)[::-1]]).T, fc=colour, ec=PALE)
        _label(axes, stairs.head, f"stairs, {stairs.rise:+g} m", GREY, 0)
    for x1, y1, x2, y2 in cut_walls(world)[0]:
        axes.plot([x1, x2], [y1, y2], color="#24292f", lw=3.5, solid_capstyle="butt", clip_on=False)
    for x, y, radius in world.pillars:
        axes.add_patch(Circle((x, y), radius, color=GREY))
    for box in world.boxes or ():
        tilt, (x, y, _), (wide, deep, high) = math.radians(box.tilt_deg), box.at, box.size
        deep = deep * math.cos(tilt) + high * abs(math.sin(tilt))  # a leaning box covers a rectangle
        corner, turned = (x - wide / 2, y - deep / 2), dict[str, Any](angle=box.turn_deg, rotation_point="center")
        axes.add_patch(Rectangle(corner, wide, deep, **turned, fc=PALE, ec=GREY))
    for at in world.service:
        axes.plot(*at, "s", mfc="white", mec="#24292f")
    for at, name in [*((door.at, "door") for door in world.doors), *((at, "service") for at in world.service)]:
        _label(axes, at, name, GREY, 6, weight="normal")


def _draw_ways(axes: Any, scenario: Scenario, orders: list[OrderMark]) -> None:
    """Draws the ways and starts of groups, and the orders with the ways that they open."""
    from matplotlib.patches import Circle

    colour: dict[str, str] = {}
    used: list[XY] = []
    for k, group in enumerate(scenario.group):
        colour |= dict.fromkeys(group_names(group), COLOURS[k % len(COLOURS)])
        points = tuple(map(_at, (group.start, *(stop.at for stop in group.stops), *group.via, group.goal)))
        _draw_way(axes, points, COLOURS[k % len(COLOURS)], lw=1.4, alpha=0.75)
        _draw_spread(axes, group.goal, COLOURS[k % len(COLOURS)])
    for k, name in enumerate(
        (name for mark in orders for name in mark.ways if name not in colour), len(scenario.group)
    ):
        colour[name] = COLOURS[k % len(COLOURS)]
    for mark in orders:
        for name, way in mark.ways.items():
            _draw_way(axes, way, colour[name], lw=2, alpha=0.9, ls="--")
            if not mark.slots:  # the way from a queue is that of all its groups
                _label(axes, way[-1], name, colour[name], 6)
        for slot in mark.slots:
            axes.add_patch(Circle(slot, 0.25, fill=False, ec=GREY, ls=":"))
    for group in scenario.group:
        # Names of groups that start at nearly one place stand above each other, numbers of orders side by side.
        _draw_start(axes, group, colour[group_names(group)[0]], _neighbours(scenario, _at(group.start), used))
    used.clear()
    for number, mark in enumerate(orders, 1):
        beside = _neighbours(scenario, mark.at, used) * scenario.world.size[0] / 40
        disc = {"boxstyle": "circle,pad=0.25", "facecolor": DARK, "edgecolor": "white"}
        style: Any = {"color": "white", "weight": "bold", "ha": "center", "va": "center", "bbox": disc, "zorder": 5}
        axes.text(mark.at[0] + beside, mark.at[1], str(number), **style)


def _neighbours(scenario: Scenario, place: XY, used: list[XY]) -> int:
    """Returns how many places of `used` are nearly the same, and adds the place to them."""
    used.append(place)
    return sum(math.dist(place, at) < scenario.world.size[0] / 35 for at in used) - 1


def _draw_way(axes: Any, way: Way, colour: str, **style: Any) -> None:
    axes.plot(*np.transpose(way), color=colour, **style)
    end, before = np.array(way[-1]), np.array(way[-2])
    # The arrow's line has nearly no length, so that its head alone is seen.
    head = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 13}
    axes.annotate("", end, end - 1e-3 * (end - before), arrowprops=head)


def _draw_spread(axes: Any, point: Point, colour: str) -> None:
    from matplotlib.patches import Rectangle

    (x, y), (rx, ry) = _at(point), map(spread, point)
    if (rx, ry) != (0, 0):
        rx, ry = max(rx, 0.1), max(ry, 0.1)
        axes.add_patch(Rectangle((x - rx, y - ry), 2 * rx, 2 * ry, color=colour, alpha=0.15, lw=0))


def _draw_start(axes: Any, group: GroupSpec, colour: str, lift: int) -> None:
    """Draws a group's start: a disc, the range of a random start, name, copies and mean size."""
    _draw_spread(axes, group.start, colour)
    axes.plot(*_at(group.start), "o", ms=10, color=colour, mec="white")
    copies = f" ×{group.repeat}" if group.repeat > 1 else ""
    people = sum(middle(part.size) for part in parts_of(group))
    _label(axes, _at(group.start), f"{group.id}{copies} ({people:.2g})", colour, 8 + 12 * lift)
