"""Draws the plan of a scenario as lines of characters, the y axis pointing up.

Two columns stand for the same length in m as one row, because characters are about twice as high as wide.
"""

from __future__ import annotations

import math

from scenarios.drawing.routes import XY, group_routes, order_marks
from scenarios.schema.geometry import walls_without_doors
from scenarios.schema.scenario import Scenario

NUMBERS = "①②③④⑤⑥⑦⑧⑨⑩⑪⑫⑬⑭⑮⑯⑰⑱⑲⑳"
LEGEND = "A start of a   ◎ goal   · way   ① order   ○ queue   █ wall   ● pillar   ≡ stairs   ▣ service point"


class CharacterPlan:
    """A grid of characters over the world, the y axis pointing up; blank at first. Made from size and columns.

    State: cells: rows of characters, top row first; scale: columns per m; columns, rows: size of the grid, at least 4
    rows; a row is about as high in m as two columns are wide, less in worlds so flat that the 4 rows are needed; size:
    of the world, x, y, m.
    """

    def __init__(self, size: XY, columns: int) -> None:
        self.scale = columns / size[0]
        self.columns, self.rows = columns, max(round(size[1] * self.scale / 2), 4)
        self.size = size
        self.cells = [[" "] * columns for _ in range(self.rows)]

    def put(self, at: XY, text: str, over: str = "") -> None:
        """Writes text to the right of a point (x, y), m; with `over`, only where the grid has one of its characters."""
        text, column = text[: self.columns], self._column(at, text)
        row = min(max(int((self.size[1] - at[1]) / self.size[1] * self.rows), 0), self.rows - 1)
        for k, character in enumerate(text):
            if not over or self.cells[row][column + k] in over:
                self.cells[row][column + k] = character

    def _column(self, at: XY, text: str) -> int:
        return max(min(int(at[0] * self.scale), self.columns - len(text)), 0)

    def name(self, at: XY, text: str) -> None:
        """Writes a name to the right of a point (x, y), m."""
        column = self._column(at, text)
        step = self.size[1] / self.rows
        for shift in (0, -1, 1, -2, 2):
            y = at[1] + shift * step
            row = min(max(int((self.size[1] - y) / step), 0), self.rows - 1)
            if set(self.cells[row][column : column + len(text)]) <= {" ", "·"}:
                break
        else:
            y = at[1]
        self.put((at[0], y), text)

    def line(self, a: XY, b: XY, character: str, over: str = "", gap: float = 0.5) -> None:
        """Writes a character repeatedly along the segment from a to b (x, y in m), about `gap` columns apart, both ends
        included.
        """
        steps = max(int(math.dist(a, b) * self.scale / gap), 1)
        for k in range(steps + 1):
            self.put((a[0] + (b[0] - a[0]) * k / steps, a[1] + (b[1] - a[1]) * k / steps), character, over)

    def text(self) -> str:
        """Returns the grid as lines of text with a frame around it, joined by line breaks, without one at the end."""
        rows = ["│" + "".join(row) + "│" for row in self.cells]
        return "\n".join(["┌" + "─" * self.columns + "┐", *rows, "└" + "─" * self.columns + "┘"])


def character_plan(scenario: Scenario, columns: int = 64) -> str:
    """Returns the plan of a scenario as lines of text, `columns` characters wide plus a frame, with its size and
    legend.
    """
    world = scenario.world
    plan = CharacterPlan(world.size, columns)
    _stairs(plan, scenario)
    ways = group_routes(scenario)
    for course in ways:
        for a, b in zip(course.points, course.points[1:], strict=False):
            plan.line(a, b, "·", over=" ", gap=2)
    orders = order_marks(scenario)
    for mark in orders:
        for arrow in mark.arrows:
            for a, b in zip(arrow.points, arrow.points[1:], strict=False):
                plan.line(a, b, "·", over=" ", gap=2)
            plan.put(arrow.points[-1], "◎")
        for slot in mark.slots:
            plan.put(slot, "○")
    for wall in walls_without_doors(world):
        plan.line(wall[:2], wall[2:], "█")
    for x, y, radius in world.pillars:
        _disc(plan, (x, y), radius)
    for service in world.service:
        plan.put(service, "▣")
    for course in ways:
        plan.put(course.points[-1], "◎")
    for course in ways:
        plan.name(course.points[0], course.id.upper()[:8])
    for mark in orders:
        plan.put(mark.at, NUMBERS[(mark.number - 1) % len(NUMBERS)])
    return plan.text() + f"\n {world.size[0]:g} × {world.size[1]:g} m\n {LEGEND}"


def _stairs(plan: CharacterPlan, scenario: Scenario) -> None:
    for stairs in scenario.world.stairs:
        (fx, fy), (hx, hy) = stairs.foot, stairs.head
        length = math.dist(stairs.foot, stairs.head)
        nx, ny = -(hy - fy) / length * stairs.width / 2, (hx - fx) / length * stairs.width / 2
        for k in range(stairs.steps + 1):
            x, y = fx + (hx - fx) * k / stairs.steps, fy + (hy - fy) * k / stairs.steps
            plan.line((x - nx, y - ny), (x + nx, y + ny), "≡")


def _disc(plan: CharacterPlan, centre: XY, radius: float) -> None:
    step = 0.5 / plan.scale
    n = int(radius / step)
    for i in range(-n, n + 1):
        for j in range(-n, n + 1):
            if math.hypot(i, j) * step <= radius:
                plan.put((centre[0] + i * step, centre[1] + j * step), "●")
