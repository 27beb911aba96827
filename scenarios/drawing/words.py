"""Says in words what is in a scenario, not simulating it: values, people, orders, triggers, camera and sensor."""

from __future__ import annotations

from collections import Counter

from scenarios.loading.toml_files import toml_value
from scenarios.schema.groups import GroupSpec, Stop
from scenarios.schema.scenario import MergeOrder, Scenario, ScriptOrder, SplitOrder, When
from scenarios.schema.schedule import Schedule
from scenarios.schema.values import Distribution, Point, Value

AT_GOAL = {"stand": "stand there", "leave": "leave", "walk": "walk on"}


def number(value: Value, unit: str = "") -> str:
    """Returns a value in words: `1.2`, `1.2 ± 0.1` (normal), `0 to 5` (uniform), `about 3`, `1 or 2`, with its clip."""
    tail = f" {unit}" if unit else ""
    if not isinstance(value, Distribution):
        return f"{value:g}{tail}"
    clip = "" if value.clip is None else f" ({value.clip[0]:g} to {value.clip[1]:g})"
    if value.normal is not None:
        return f"{value.normal[0]:g} ± {value.normal[1]:g}{tail}{clip}"
    if value.uniform is not None:
        return f"{value.uniform[0]:g} to {value.uniform[1]:g}{tail}"
    if value.choice is not None:
        times = Counter(value.choice)
        equal = len(set(times.values())) == 1
        shares = {v: "" if equal else f" ({n / len(value.choice):.0%})" for v, n in times.items()}
        return " or ".join(f"{v:g}{share}" for v, share in shares.items()) + tail
    mean = value.exponential if value.exponential is not None else value.poisson
    return f"about {mean:g}{tail}{clip}"


def changing(value: float | Schedule, form: str = "g") -> str:
    """Returns a value that may change in words: `0.3`, `0.3 (from 20 s 1.5, from 40 s 0.3, each within 5 s)`."""
    if not isinstance(value, Schedule):
        return format(value, form)
    later = [f"from {at:g} s {v:{form}}" for at, v in zip(value.at[1:], value.value[1:], strict=True)]
    later += [f"each within {value.ramp:g} s"] * (value.ramp > 0)
    return f"{value.value[0]:{form}} ({', '.join(later)})"


def place(point: Point) -> str:
    """Returns a point in words: `(5, 3 to 4)`."""
    return f"({number(point[0])}, {number(point[1])})"


def count(n: Value, one: str, many: str) -> str:
    """Returns a value in words with its noun, `one` for 1, else `many`: `1 person`, `3 people`."""
    return f"{number(n)} {one if n == 1 else many}"


def setting(scenario: Scenario) -> list[str]:
    """Returns three lines: duration and placement of the script, the world, the camera."""
    world, camera = scenario.world, scenario.camera
    things = {"wall": world.walls, "door": world.doors, "pillar": world.pillars, "flight of stairs": world.stairs}
    things |= {"service point": world.service, "box": world.boxes or ()}
    things_in_it = [
        f"{len(rows)} {name}{('es' if name == 'box' else 's') * (len(rows) > 1)}"
        for name, rows in things.items()
        if rows
    ]
    turned = [] if scenario.turn_deg == 0.0 else [f"turned by {number(scenario.turn_deg)}°"]
    turned += ["mirrored by a coin"] * scenario.mirror
    turned += [] if scenario.lead == 0.0 else [f"{number(scenario.lead, 's')} further on than it says"]
    view = "from above" if camera.kind == "top" else f"looking down {camera.tilt_deg:g}°"
    solved = "" if camera.height is not None or camera.px_per_m is not None else ", placed to see everybody"
    script = f"; the script is {', '.join(turned)}" if turned else ""
    return [
        f"{scenario.duration:g} s after {scenario.warmup:g} s of warm-up{script}",
        f"world {world.size[0]:g} × {world.size[1]:g} m"
        + (f": {', '.join(things_in_it)}" if things_in_it else ", empty"),
        f"camera {view}, {camera.image[0]} × {camera.image[1]} px, {camera.fps:g} frames/s{solved}",
    ]


def people(group: GroupSpec) -> str:
    """Returns in words who a `group` entry of a scenario is: size, start, stops, goal, speed, time of entry."""
    parts = [f"{part.repeat} × " * (part.repeat > 1) + f"{part.id} of {number(part.size)}" for part in group.groups]
    words = [f"{', '.join(parts)} behind each other" if parts else count(group.size, "person", "people")]
    words[0] = f"{group.repeat} groups of {words[0]}" if group.repeat > 1 else words[0]
    words.append(f"from {place(group.start)}")
    words += [f"stopping at {', '.join(map(_stop, group.stops))}"] if group.stops else []
    words += [f"past {', '.join(map(place, group.via))}"] if group.via else []
    words.append(f"to {place(group.goal)}")
    text = " ".join(words)
    text += f", at {number(group.speed, 'm/s')}" if group.speed is not None else ""
    text += f", {number(group.height, 'm')} tall" if group.height is not None else ""
    worn = [" or ".join(colours) for colours in (group.clothes, group.trousers) if colours is not None]
    text += f", dressed in {' and '.join(worn)}" if worn else ""
    text += f", scattered by {number(group.scatter, 'm')}" if group.scatter != 0.0 else ""
    text += f", entering at {number(group.enter, 's')}" if group.enter != 0.0 else ""
    return f"{text}; then they {AT_GOAL[group.at_goal]}"


def _stop(stop: Stop) -> str:
    words = [f"until {', '.join(f'{t:g}' for t in stop.until)} s"] if stop.until else []
    words += [f"for {number(stop.stay, 's')}"] if stop.stay != 0.0 else []
    words += [] if stop.members is None else [f"only {count(stop.members, 'member', 'members')}"]
    return f"{place(stop.at)} [{', '.join(words)}]"


def trigger(when: When) -> str:
    """Returns in words when an order fires, such as `at 5 s`."""
    if when.time is not None:
        text = f"at {number(when.time, 's')}"
    elif when.reach is not None:
        goal = "its goal" if when.reach.at is None else place(when.reach.at)
        text = f"when {when.reach.group} comes within {when.reach.radius:g} m of {goal}"
    elif when.after is not None:
        text = f"after {when.after}"
    else:
        text = f"when they are closer than {when.distance_lt:g} m"
    return text if when.delay == 0.0 else f"{text}, {number(when.delay, 's')} later"


def order(event: ScriptOrder) -> str:
    """Returns in words what an order does, such as `merge a + b → c, to meet and stand`."""
    if isinstance(event, MergeOrder):
        goal = "to meet and stand" if isinstance(event.goal, str) else f"to {place(event.goal)}"
        return f"merge {' + '.join(event.groups)} → {event.into}, {goal}"
    if isinstance(event, SplitOrder):
        parts = [f"{p.id} ({p.size or 'rest'}) to {place(p.goal)}" for p in event.parts]
        return f"split {event.group} → {', '.join(parts)}"
    where = "" if event.counters is None else f" at the next free of {', '.join(map(place, event.counters))}"
    served = "" if event.goal is None else f", then to {place(event.goal)}"
    lined = f"queue {', '.join(event.groups)} at {place(event.at)}"
    return f"{lined}, served {number(event.service, 's')} each{where}{served}"


def sensor(scenario: Scenario) -> list[str]:
    """Returns lines of text about the sensor: its rates, each other key that differs from the default, `hide`."""
    s = scenario.sensor
    changed = s.model_dump(exclude_defaults=True, exclude={"detect_prob", "clutter_rate", "hide"})
    rate = f"{changing(s.clutter_rate)} false alarms per frame"
    lines = [
        f"detects {changing(s.detect_prob, '.0%')} of fully visible people, {rate}",
        *(f"{k} = {toml_value(v)}" for k, v in changed.items()),
    ]
    return lines + [f"hides {h.group or 'everybody'} from {h.start:g} to {h.end:g} s" for h in s.hide]


def text(scenario: Scenario) -> str:
    """Returns a description of a scenario in words, a text of several lines: setting, people, orders, sensor."""
    lines = [scenario.name, *([scenario.about] if scenario.about else []), "", *setting(scenario), "", "People"]
    wide = max(len(group.id) for group in scenario.group)
    lines += [f"  {group.id:<{wide}}  {people(group)}" for group in scenario.group]
    lines += ["", "Orders"] + ([] if scenario.event else ["  none"])
    for k, event in enumerate(scenario.event):
        lines += [f"  {k + 1} {event.id}  {order(event)}", f"      {trigger(event.when)}"]
    draws = {f"draw.{name}": value.model_dump(exclude_none=True) for name, value in (scenario.draw or {}).items()}
    lines += ["", "Sensor", *("  " + line for line in sensor(scenario))]
    rows = [f"  {key} = {toml_value(value)}" for key, value in (draws | (scenario.draws or {})).items()]
    return "\n".join([*lines, *(["", "Drawn for each seed (above: one example)"] if rows else []), *rows, ""])


def cut(words: str, length: int) -> str:
    """Returns the text if it has at most `length` characters, else its beginning with "…", `length` characters."""
    return words if len(words) <= length else words[: length - 1] + "…"
