"""Draws a scenario as SVG, without simulating it: a plan, and beneath it the orders of the script in words.

The plan shows ground, walls and pillars, ways, starts and orders, as far as they are known before the simulation. A
distribution is replaced by its mean and the range of its draws. Where groups meet, and where a group divides, is taken
to be half-way.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.drawing import words as describe
from scenarios.schema.geometry import queue_places, walls_without_doors
from scenarios.schema.scenario import GroupSpec, MergeOrder, Scenario, ScriptOrder, SplitOrder, expand, group_names
from scenarios.schema.values import Distribution, Point, Value, bounds

XY = tuple[float, float]
Way = tuple[XY, ...]
SLOTS = 6  # greatest number of places of a queue that are drawn
WIDTH, TALLEST = 9.0, 6.2  # inches: of the drawing; greatest height of the plan
ROW = 0.3  # inches between the words of orders
# Of groups: dark enough to read on white, and distinct for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#3d6fd6", "#b2182b", "#4d7c0f", "#6a51a3", "#5c5c5c")
DARK, GREY, PALE = "#1b1f24", "#57606a", "#8c959f"
STYLE: Any = {"svg.fonttype": "none", "svg.hashsalt": "flockscope", "font.size": 9, "text.parse_math": False}
CLEAR = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5}  # behind labels


@dataclass(frozen=True)
class OrderMark:
    """An order of the script as drawn on the plan."""

    number: int  # of the order in the file, from 1
    event: ScriptOrder  # the order
    at: XY  # x, y of where it happens, m
    group: str  # the first of its groups before it
    ways: dict[str, Way]  # those it opens, by name of the group; empty if groups stay or keep their goals
    slots: Way = ()  # x, y of the places of a queue, m; empty for other orders


def middle(value: Value) -> float:
    """Returns the mean of a value, moved into its `clip`."""
    if not isinstance(value, Distribution):
        return float(value)
    if value.normal is not None:
        mean = value.normal[0]
    elif values := value.uniform or value.choice:
        mean = float(np.mean(values))
    else:
        mean = value.exponential or value.poisson or 0.0
    low, high = bounds(value)
    return min(max(mean, low), high)


def spread(value: Value) -> float:
    """Returns half the width of the range in which nearly all draws of a value lie; 0 for a number."""
    if not isinstance(value, Distribution):
        return 0.0
    low, high = bounds(value)
    wide = (high - low) / 2
    if value.normal is not None:
        return min(wide, 2 * value.normal[1])
    return wide if math.isfinite(wide) else 2 * middle(value)


def _at(point: Point) -> XY:
    return middle(point[0]), middle(point[1])


def _mean(*points: XY) -> XY:
    x, y = np.mean(points, axis=0)
    return float(x), float(y)


def _mark(number: int, event: ScriptOrder, places: dict[str, tuple[XY, XY]], world: XY) -> OrderMark:
    """Returns an order as drawn, and changes the start and goal of its groups in `places`."""
    ways: dict[str, Way]
    if isinstance(event, MergeOrder):
        at = _mean(*(_mean(*places.pop(name)) for name in event.groups))
        goal = at if isinstance(event.goal, str) else _at(event.goal)
        places[event.into] = (at, goal)
        ways = {} if goal == at else {event.into: (at, *map(_at, event.via), goal)}
        return OrderMark(number, event, at, event.groups[0], ways)
    if isinstance(event, SplitOrder):
        at = _mean(*places.pop(event.group))
        ways = {part.id: (at, *map(_at, part.via), _at(part.goal)) for part in event.parts}
        places.update({name: (at, way[-1]) for name, way in ways.items()})
        return OrderMark(number, event, at, event.group, ways)
    names = [name for pattern in event.groups for name in expand(pattern, list(places))]
    inside = tuple((x, y) for x, y in queue_places(event, SLOTS) if 0 <= x <= world[0] and 0 <= y <= world[1])
    ways = {} if event.goal is None else {"served": (event.at, _at(event.goal))}
    places.update({name: (event.at, way[-1]) for way in ways.values() for name in names})
    return OrderMark(number, event, event.at, names[0], ways, inside)


def svg(scenario: Scenario) -> str:
    """Returns an SVG drawing of a scenario: the plan with starts, ways and goals, and beneath it the orders."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    places = {name: (_at(group.start), _at(group.goal)) for group in scenario.group for name in group_names(group)}
    orders = [_mark(k, event, places, scenario.world.size) for k, event in enumerate(scenario.event, 1)]
    colour = _colours(scenario, orders)
    width, depth = scenario.world.size
    tall = min(TALLEST, (WIDTH - 0.6) * depth / width)
    script = tall + 1.2  # inches from the top to the script
    height = script + ROW * (len(orders) + 1)
    texts: list[tuple[float, float, str, dict[str, Any]]] = [
        (0.03, 0.25, scenario.name, {"size": 13, "weight": "bold"}),
        (0.03, 0.5, describe.cut(scenario.about, 140), {"color": GREY}),
        (0.03, script - 0.05, "Script", {"weight": "bold"}),
    ]
    for k, mark in enumerate(orders, 1):
        words = f"{mark.event.id}: {describe.order(mark.event)} — {describe.trigger(mark.event.when)}"
        texts.append((0.065, script + ROW * k, describe.cut(words, 128), {"va": "center"}))
    with rc_context(STYLE):
        figure, out = Figure((WIDTH, height)), io.StringIO()
        for x, down, words, style in texts:
            figure.text(x, 1 - down / height, words, **style)
        wide = tall * width / depth
        plan = figure.add_axes(((WIDTH - wide) / 2 / WIDTH, 1 - (0.7 + tall) / height, wide / WIDTH, tall / height))
        _draw_world(plan, scenario)
        _draw_orders(plan, scenario, orders, colour)
        for k, mark in enumerate(orders, 1):
            _number(figure, (0.04, 1 - (script + ROW * k) / height), mark.number)
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()


def _number(place: Any, at: XY, number: int) -> None:
    """Writes an order's number in a black disc on axes or figure."""
    disc = {"boxstyle": "circle,pad=0.25", "facecolor": DARK, "edgecolor": "white"}
    place.text(*at, str(number), color="white", weight="bold", ha="center", va="center", bbox=disc, zorder=5)


def _label(axes: Any, at: XY, words: str, colour: str, up: float, **style: Any) -> None:
    style = {"color": colour, "weight": "bold", "ha": "center", "bbox": CLEAR, "textcoords": "offset points", **style}
    axes.annotate(words, at, (0, up), **style)


def _draw_world(axes: Any, scenario: Scenario) -> None:
    from matplotlib.patches import Circle

    world, (width, depth) = scenario.world, scenario.world.size
    step = 1.0 if width <= 40 else 5.0
    axes.set(xlim=(0, width), ylim=(0, depth), xticks=np.arange(0, width, step), yticks=np.arange(0, depth, step))
    axes.set(facecolor="#f6f8fa", axisbelow=True)
    axes.tick_params(length=0, labelbottom=False, labelleft=False)
    axes.spines[:].set_color(PALE)
    axes.grid(color="#e3e7ec")
    note = f"{width:g} × {depth:g} m, a line each {'metre' if step == 1 else f'{step:g} m'}"
    _label(axes, (0, 0), note, GREY, -11, weight="normal", ha="left")
    for stairs in world.stairs:
        foot, head = np.array(stairs.foot), np.array(stairs.head)
        along = (head - foot) / math.dist(foot, head)
        side = np.array([[-along[1], along[0]], [along[1], -along[0]]]) * stairs.width / 2
        axes.fill(*np.concatenate([foot + side, (head + along * stairs.landing + side)[::-1]]).T, fc="#eaeef2", ec=PALE)
        for share in np.linspace(0, 1, stairs.steps + 1):
            axes.plot(*(foot + share * (head - foot) + side).T, color=PALE, lw=0.7)
        _label(axes, stairs.head, f"stairs, {stairs.rise:+g} m", GREY, 0)
    for x1, y1, x2, y2 in walls_without_doors(world):
        axes.plot([x1, x2], [y1, y2], color="#24292f", lw=3.5, solid_capstyle="butt", clip_on=False)
    for x, y, radius in world.pillars:
        axes.add_patch(Circle((x, y), radius, color=GREY))
    for at in world.service:
        axes.plot(*at, "s", mfc="white", mec="#24292f")
    for at, name in [*((door.at, "door") for door in world.doors), *((at, "service") for at in world.service)]:
        _label(axes, at, name, GREY, 6, weight="normal")


def _draw_orders(axes: Any, scenario: Scenario, orders: list[OrderMark], colour: dict[str, str]) -> None:
    """Draws the ways and starts of groups, and the orders with the ways that they open."""
    from matplotlib.patches import Circle

    width, used = scenario.world.size[0], list[XY]()
    for group in scenario.group:
        points = tuple(map(_at, (group.start, *(stop.at for stop in group.stops), *group.via, group.goal)))
        _draw_way(axes, points, colour[group.id], lw=1.4, alpha=0.75)
        _draw_spread(axes, group.goal, colour[group.id])
        axes.plot(*points[-1], "o", ms=10, mfc="none", mec=colour[group.id])
    for mark in orders:
        for name, way in mark.ways.items():
            c = colour.get(mark.group if name == "served" else name, GREY)
            _draw_way(axes, way, c, lw=2, alpha=0.9, ls="--")
            if name != "served":
                _label(axes, way[-1], name, c, 6)
        for slot in mark.slots:
            axes.add_patch(Circle(slot, 0.25, fill=False, ec=GREY, ls=":"))
    for group in scenario.group:
        # Names of groups that start at nearly one place stand above each other, numbers of orders side by side.
        beside = sum(math.dist(_at(group.start), at) < width / 35 for at in used)
        used.append(_at(group.start))
        _draw_start(axes, group, colour[group.id], beside)
    used.clear()
    for mark in orders:
        beside = sum(math.dist(mark.at, at) < width / 35 for at in used)
        used.append(mark.at)
        _number(axes, (mark.at[0] + beside * width / 40, mark.at[1]), mark.number)


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
    """Draws a group's start: its people as discs, the range of a random start, name, copies and mean size."""
    from matplotlib.patches import Circle

    people, (x, y) = middle(group.size), _at(group.start)
    n = min(max(round(people), 1), 12)
    _draw_spread(axes, group.start, colour)
    reach = 0.0 if n == 1 else 0.75 / (2 * math.sin(math.pi / n))
    for angle in 2.4 + np.arange(n) * math.tau / n:
        axes.add_patch(Circle((x + reach * math.cos(angle), y + reach * math.sin(angle)), 0.22, fc=colour, ec="white"))
    copies = f" ×{group.repeat}" if group.repeat > 1 else ""
    words = f"{group.id}{copies} ({people:.2g})"
    _label(axes, (x, y + reach + 0.22), words, colour, 4 + 12 * lift)


def _colours(scenario: Scenario, orders: list[OrderMark]) -> dict[str, str]:
    names = [[group.id, *group_names(group)] for group in scenario.group] + [
        [name] for mark in orders for name in mark.ways
    ]
    named: dict[str, str] = {}
    for k, some in enumerate(names):
        for name in some:
            named.setdefault(name, COLOURS[k % len(COLOURS)])
    return named
