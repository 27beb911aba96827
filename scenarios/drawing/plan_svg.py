"""Draws a scenario as SVG, without simulating it: the plan, and beneath it the script.

The plan shows ground, walls and pillars, ways, starts and orders; the script the groups that merge, split and queue.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape

from scenarios.drawing import words as describe
from scenarios.drawing.routes import XY, GroupRoute, OrderMark, group_routes, order_marks
from scenarios.schema.geometry import walls_without_doors
from scenarios.schema.scenario import Scenario, StairsSpec, WorldSpec

WIDTH, MARGIN = 900.0, 26.0
# Of groups: dark enough to read on white, and distinct for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#3d6fd6", "#b2182b", "#4d7c0f", "#6a51a3", "#5c5c5c")
ROW = 30.0  # px between the lines of groups in the drawing of the script
STYLE = """
text { font: 13px system-ui, sans-serif; fill: #1b1f24 } .small { font-size: 11.5px; fill: #57606a }
.halo { paint-order: stroke; stroke: #fff; stroke-width: 3.5px; stroke-linejoin: round; font-weight: 600 }
.wall { stroke: #24292f; stroke-width: 5; stroke-linecap: butt } .door { stroke: #24292f; stroke-dasharray: 2 4 }
.way { fill: none; stroke-width: 1.8; opacity: .75 } .order { stroke-width: 2.6; stroke-dasharray: 7 4; opacity: .9 }
"""


class SvgPlan:
    """Draws in world metres (y up) on a picture in px (y down), 900 px wide; methods return SVG elements.

    State: world; scale, px per m; left, top: px of the world's upper left corner; bottom: lower end of the plan, px.
    """

    def __init__(self, world: WorldSpec) -> None:
        self.world = world
        self.scale = min((WIDTH - 2 * MARGIN) / world.size[0], 620 / world.size[1])
        self.left = (WIDTH - world.size[0] * self.scale) / 2
        self.top = 56.0
        self.bottom = self.top + world.size[1] * self.scale + 20

    def __call__(self, at: XY) -> XY:
        """Returns a point of the world, m, as a point of the picture, px."""
        return self.left + at[0] * self.scale, self.top + (self.world.size[1] - at[1]) * self.scale

    def path(self, points: Iterable[XY], attributes: str) -> str:
        """Returns a line through points of the world. attributes: SVG text such as `class="wall"`."""
        through = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self, points))
        return f'<polyline points="{through}" {attributes}/>'

    def label(self, at: XY, words: str, dx: float = 0, dy: float = 0, attributes: str = "") -> str:
        """Returns a text at a point of the world, shifted by dx, dy px; words are escaped, attributes are not."""
        x, y = self(at)
        return f'<text x="{x + dx:.1f}" y="{y + dy:.1f}" {attributes}>{escape(words)}</text>'

    def floor(self) -> list[str]:
        """Returns the ground: a line for each metre (5 m in wide worlds), a frame, and the world's size in words."""
        width, depth = self.world.size
        (x0, y1), (x1, y0) = self((0, 0)), self((width, depth))
        step = 1.0 if width <= 40 else 5.0
        lines = [self.path([(k * step, 0), (k * step, depth)], "") for k in range(1, math.ceil(width / step))]
        lines += [self.path([(0, k * step), (width, k * step)], "") for k in range(1, math.ceil(depth / step))]
        frame = f'<rect x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" height="{y1 - y0:.1f}"'
        note = f"{width:g} × {depth:g} m, a line each {'metre' if step == 1 else f'{step:g} m'}"
        return [
            f'{frame} fill="#f6f8fa"/>',
            f'<g stroke="#e3e7ec" stroke-width="1">{"".join(lines)}</g>',
            f'{frame} fill="none" stroke="#8c959f"/>',
            self.label((0, 0), note, 0, 15, 'class="small"'),
        ]

    def scene(self) -> list[str]:
        """Returns stairs, walls without their doors, pillars and service points."""
        parts = [part for stairs in self.world.stairs for part in self._stairs(stairs)]
        parts += [self.path([wall[:2], wall[2:]], 'class="wall"') for wall in walls_without_doors(self.world)]
        parts += [self.label(door.at, "door", 0, -8, 'class="small" text-anchor="middle"') for door in self.world.doors]
        for x, y, radius in self.world.pillars:
            u, v = self((x, y))
            parts.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{radius * self.scale:.1f}" fill="#57606a"/>')
        for at in self.world.service:
            u, v = self(at)
            parts.append(f'<rect x="{u - 6:.1f}" y="{v - 6:.1f}" width="12" height="12" fill="#fff" stroke="#24292f"/>')
            parts.append(self.label(at, "service", 0, -10, 'class="small" text-anchor="middle"'))
        return parts

    def _stairs(self, stairs: StairsSpec) -> list[str]:
        (fx, fy), (hx, hy) = stairs.foot, stairs.head
        length = math.dist(stairs.foot, stairs.head)
        ex, ey = (hx - fx) / length, (hy - fy) / length
        nx, ny = -ey * stairs.width / 2, ex * stairs.width / 2
        end = (hx + ex * stairs.landing, hy + ey * stairs.landing)
        corners = [(fx - nx, fy - ny), (fx + nx, fy + ny), (end[0] + nx, end[1] + ny), (end[0] - nx, end[1] - ny)]
        steps = [
            (fx + (hx - fx) * k / stairs.steps, fy + (hy - fy) * k / stairs.steps) for k in range(stairs.steps + 1)
        ]
        lines = [self.path([(x - nx, y - ny), (x + nx, y + ny)], 'stroke="#8c959f"') for x, y in steps]
        words = f"stairs, {stairs.rise:+g} m"
        return [
            self.path([*corners, corners[0]], 'fill="#eaeef2" stroke="#8c959f"'),
            *lines,
            self.label(stairs.head, words, 0, 4, 'class="small halo" text-anchor="middle"'),
        ]

    def route(self, route: GroupRoute, colour: str) -> list[str]:
        """Returns a group's way and goal, and the range of a random goal."""
        end = route.points[-1]
        u, v = self(end)
        return [
            *self._spread(end, route.spread[-1], colour),
            self.path(route.points, f'class="way" stroke="{colour}" marker-end="url(#{colour[1:]})"'),
            f'<circle cx="{u:.1f}" cy="{v:.1f}" r="7" fill="none" stroke="{colour}" stroke-width="1.6"/>',
        ]

    def _spread(self, at: XY, half: XY, colour: str) -> list[str]:
        if half == (0, 0):
            return []
        u, v = self(at)
        rx, ry = (max(h * self.scale, 3) for h in half)
        return [
            f'<rect x="{u - rx:.1f}" y="{v - ry:.1f}" width="{2 * rx:.1f}" height="{2 * ry:.1f}" rx="3" '
            f'fill="{colour}" opacity=".15"/>'
        ]

    def start(self, route: GroupRoute, colour: str, lift: int = 0) -> list[str]:
        """Returns a group's start: its people as discs, the range of a random start, name, copies and mean size."""
        at, parts = route.points[0], self._spread(route.points[0], route.spread[0], colour)
        n = min(max(round(route.people), 1), 12)
        reach = 0.0 if n == 1 else 0.75 / (2 * math.sin(math.pi / n))
        for k in range(n):
            u, v = self(
                (at[0] + reach * math.cos(2.4 + k * math.tau / n), at[1] + reach * math.sin(2.4 + k * math.tau / n))
            )
            r = max(0.22 * self.scale, 3)
            parts.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{r:.1f}" fill="{colour}" stroke="#fff"/>')
        words = route.id + (f" ×{route.repeat}" if route.repeat > 1 else "") + f" ({route.people:.2g})"
        dy = -(reach + 0.22) * self.scale - 6 - 15 * lift
        parts.append(self.label(at, words, 0, dy, f'class="halo" text-anchor="middle" style="fill:{colour}"'))
        return parts

    def mark(self, mark: OrderMark, colour: dict[str, str]) -> list[str]:
        """Returns an order: the ways that it opens, and the places of a queue. colour: by group name."""
        parts = []
        for arrow in mark.arrows:
            c = colour.get(arrow.id, colour[mark.before[0]])
            style = f'class="way order" stroke="{c}" marker-end="url(#{c[1:]})"'
            parts.append(self.path(arrow.points, style))
            if arrow.id != "served":
                end = f'class="halo" text-anchor="middle" style="fill:{c}"'
                parts.append(self.label(arrow.points[-1], arrow.id, 0, -11, end))
        for slot in mark.slots:
            u, v = self(slot)
            r = max(0.25 * self.scale, 3)
            parts.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{r:.1f}" fill="none" stroke="#57606a" class="door"/>')
        return parts

    def numbers(self, orders: list[OrderMark]) -> list[str]:
        """Returns the number of each order at its place."""
        parts, used = [], dict[tuple[int, int], int]()
        for mark in orders:
            u, v = self(mark.at)
            # Orders at nearly one place stand side by side.
            cell = (round(u / 24), round(v / 24))
            used[cell] = used.get(cell, 0) + 1
            parts.append(badge(u + 22 * (used[cell] - 1), v, mark.number))
        return parts


def badge(x: float, y: float, number: int) -> str:
    """Returns an order's number in a black disc at (x, y) px."""
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="10" fill="#1b1f24" stroke="#fff" stroke-width="1.5"/>'
        f'<text x="{x:.1f}" y="{y + 4.3:.1f}" text-anchor="middle" style="fill:#fff;font-weight:700">{number}</text>'
    )


def marker(colour: str) -> str:
    """Returns the definition of an arrow head in a colour #rrggbb; its id is the colour without #."""
    return (
        f'<marker id="{colour[1:]}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="9" markerHeight="9" '
        f'markerUnits="userSpaceOnUse" orient="auto"><path d="M0,0.5 L8,4 L0,7.5 z" fill="{colour}"/></marker>'
    )


def svg(scenario: Scenario) -> str:
    """Returns an SVG drawing of a scenario: the plan with starts, ways and goals, and beneath it the script."""
    plan = SvgPlan(scenario.world)
    ways, orders = group_routes(scenario), order_marks(scenario)
    colour = _colours(ways, orders)
    body = [*plan.floor(), *plan.scene()]
    for course in ways:
        body += plan.route(course, colour[course.id])
    for mark in orders:
        body += plan.mark(mark, colour)
    for k, course in enumerate(ways):
        lift = sum(math.dist(course.points[0], other.points[0]) * plan.scale < 24 for other in ways[:k])
        body += plan.start(course, colour[course.id], lift)
    body += plan.numbers(orders)
    script, bottom = _script(ways, orders, colour, plan.bottom + 26)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {bottom:.0f}" width="{WIDTH:g}" '
        f'height="{bottom:.0f}" role="img" aria-label="{escape(scenario.name)}: {escape(scenario.about)}">'
    )
    title = f'<text x="{MARGIN}" y="24" style="font-size:17px;font-weight:700">{escape(scenario.name)}</text>'
    caption = f'<text x="{MARGIN}" y="43" class="small">{escape(_cut(scenario.about, 140))}</text>'
    markers = "".join(marker(c) for c in dict.fromkeys(colour.values()))
    ground = f'<rect width="{WIDTH:g}" height="{bottom:.0f}" fill="#fff"/>'
    parts = [head, f"<style>{STYLE}</style><defs>{markers}</defs>", ground, title, caption, *body, *script, "</svg>"]
    return "\n".join(parts) + "\n"


def _colours(ways: list[GroupRoute], orders: list[OrderMark]) -> dict[str, str]:
    named: dict[str, str] = {}
    for k, course in enumerate(ways):
        c = COLOURS[k % len(COLOURS)]
        named.update(dict.fromkeys([course.id, *(f"{course.id}-{k + 1}" for k in range(course.repeat))], c))
    for k, name in enumerate(name for mark in orders for name in mark.after if name not in named):
        named.setdefault(name, COLOURS[(len(ways) + k) % len(COLOURS)])
    return named


def _cut(words: str, length: int) -> str:
    return words if len(words) <= length else words[: length - 1] + "…"


def _script(
    ways: list[GroupRoute], orders: list[OrderMark], colour: dict[str, str], top: float
) -> tuple[list[str], float]:
    parts = [f'<text x="{MARGIN}" y="{top:.0f}" style="font-weight:700">Script</text>']
    rows, x0 = {course.id: k for k, course in enumerate(ways)}, MARGIN + 60
    step = min((WIDTH - 2 * MARGIN - 110) / max(len(orders), 1), 170)
    lines, heights = _lines(rows, {name: course.id for course in ways for name in _names(course)}, orders)
    y0 = top + 26
    for name, words in {c.id: f"{c.id} ×{c.repeat}" if c.repeat > 1 else c.id for c in ways}.items():
        y = y0 + rows[name] * ROW + 4
        parts.append(f'<text x="{x0 - 8}" y="{y}" text-anchor="end" style="fill:{colour[name]}">{escape(words)}</text>')
    for name, row, start, end, to in lines:
        a, b, y, y1 = x0 + start * step, x0 + end * step, y0 + row * ROW, y0 + to * ROW
        bend = min(step * 0.4, b - a)
        path = (
            f"M{a:.1f},{y:.1f} H{b - bend:.1f} C{b - bend / 2:.1f},{y:.1f} {b - bend / 2:.1f},{y1:.1f} {b:.1f},{y1:.1f}"
        )
        parts.append(f'<path d="{path}" fill="none" stroke="{colour[name]}" stroke-width="5" stroke-linecap="round"/>')
        if start > 0 and end - start > 0.5:
            label = f'text-anchor="middle" class="halo" style="fill:{colour[name]}"'
            parts.append(f'<text x="{a + step * 0.35:.1f}" y="{y - 7:.1f}" {label}>{escape(name)}</text>')
    for number, touched in heights.items():
        x, marked = x0 + number * step, [y0 + row * ROW for row in touched]
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#1b1f24" stroke="#fff"/>' for y in marked[1:]]
        parts.append(badge(x, marked[0], number))
    y = y0 + (max([row for _, row, *_ in lines], default=0) + 1) * ROW + 12
    for mark in orders:
        words = f"{mark.event.id}: {describe.order(mark.event)} — {describe.trigger(mark.event.when)}"
        parts += [badge(MARGIN + 10, y - 4, mark.number)]
        parts += [f'<text x="{MARGIN + 30}" y="{y:.1f}">{escape(_cut(words, 128))}</text>']
        y += 26
    return parts, y


def _names(course: GroupRoute) -> list[str]:
    return [f"{course.id}-{k + 1}" for k in range(course.repeat)] if course.repeat > 1 else [course.id]


ScriptLine = tuple[str, int, float, float, float]


def _lines(
    rows: dict[str, int], row_of: dict[str, str], orders: list[OrderMark]
) -> tuple[list[ScriptLine], dict[int, list[int]]]:
    """Returns the lines of groups (name, row, from order, to order, row at its end), and the rows that each order
    concerns.
    """
    since = dict.fromkeys(rows, 0.0)
    lines: list[ScriptLine] = []
    at: dict[int, list[int]] = {}
    for mark in orders:
        if mark.before == mark.after:
            at[mark.number] = [rows[name] for name in dict.fromkeys(row_of.get(n, n) for n in mark.before)]
            continue
        ending = [name for name in mark.before if name in since]
        taken = {rows[name] for name in since if name not in ending}
        home = rows[ending[0]] if ending else next(row for row in range(10_000) if row not in taken)
        at[mark.number] = [home]
        for name in mark.before:
            row = rows[row_of.get(name, name)]
            start = since.pop(name) if name in ending else mark.number - 0.4
            # One group of a `repeat` branches off; the line of the others goes on.
            lines.append((name, row, start, mark.number, home))
        free = (row for row in range(home, 10_000) if row not in taken)
        for name in mark.after:
            rows[name], since[name] = next(free), mark.number
            if rows[name] != home:
                lines.append((name, home, mark.number, mark.number + 0.3, rows[name]))
                since[name] = mark.number + 0.3
    end = len(orders) + 0.6
    return lines + [(name, rows[name], start, end, rows[name]) for name, start in since.items()], at
