"""Explains a scenario without simulating it: `text` describes it in words, `svg` draws its plan and its script.

The script is the groups that merge, split and queue.
"""

from __future__ import annotations

import math
from html import escape

from scenarios.drawing import words as describe
from scenarios.drawing.plan_svg import MARGIN, STYLE, WIDTH, SvgPlan, badge, marker
from scenarios.drawing.routes import GroupRoute, OrderMark, group_routes, order_marks
from scenarios.schema.scenario import Scenario

# Of groups: dark enough to read on white, and distinct for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#3d6fd6", "#b2182b", "#4d7c0f", "#6a51a3", "#5c5c5c")
ROW = 30.0  # px between the lines of groups in the drawing of the script


def text(scenario: Scenario) -> str:
    """Returns a description of a scenario for people, as lines of text: setting, people, orders, sensor."""
    lines = [
        scenario.name,
        *([scenario.about] if scenario.about else []),
        "",
        *describe.setting(scenario),
        "",
        "People",
    ]
    wide = max(len(group.id) for group in scenario.group)
    lines += [f"  {group.id:<{wide}}  {describe.people(group)}" for group in scenario.group]
    lines += ["", "Orders"] + ([] if scenario.event else ["  none"])
    for k, event in enumerate(scenario.event):
        lines += [f"  {k + 1} {event.id}  {describe.order(event)}", f"      {describe.trigger(event.when)}"]
    return "\n".join([*lines, "", "Sensor", *("  " + line for line in describe.sensor(scenario)), ""])


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
