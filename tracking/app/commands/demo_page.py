"""The page that `flockscope demo` ends with: one scene as it was seen, and tables of scores, rows linked to replays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape
from pathlib import Path

from tracking.app.commands.score import Row, summary
from tracking.app.commands.score_tables import SHOWN, number
from tracking.scoring.catalogue import CATALOGUE

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; color: #1b1f24 }
table { border-collapse: collapse; margin: 0 0 2rem } th, td { padding: .25rem .8rem; text-align: right }
th:first-child, td:first-child { text-align: left; white-space: nowrap }
th[title] { text-decoration: underline dotted #8a8f98; cursor: help } thead th { border-bottom: 2px solid #1b1f24 }
tfoot td { border-top: 1px solid #8a8f98; font-weight: 600 }
small { color: #57606a; font-weight: 400 }
.films { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr)); gap: 1rem }
.wide { overflow-x: auto } figure { margin: 0 0 1rem; max-width: 640px } figcaption { color: #57606a; font-size: .9em }
video { display: block; width: 100%; border-radius: 8px }
"""
INTRO = """<h1>flockscope demo</h1>
<p>Scenes in which groups merge, split, cross and queue were simulated, tracked and scored. Each name below opens a
replay: what was tracked beside what is true, with a timeline of events. The scores are those of
<code>flockscope score</code>; rest on a heading to read what it means.</p>
"""
SEEN = """<h2>One scene, from its pictures</h2>
<p>The same {frames} frames, tracked from pixels, by background subtraction, and from what a simulated detector found.
The videos show what was found in the pixels: trails, groups, events; the truth as thin white boxes. A dash in a table:
nothing that could be scored, as of people where only groups are followed.</p>
"""
FILM = """<figure><video src="{film}#t={start:.1f}" controls muted loop playsinline preload="metadata"></video>
<figcaption>{about}</figcaption></figure>"""
OF_PEOPLE = "<code>{tracker}</code>: boxes of people with ids, hulls of their groups"
OF_GROUPS = (
    "<code>{tracker}</code>: groups as wholes, with hull, extent (dotted), arrow to where it is in 1 s, people (~)"
)
WITHOUT_PEOPLE = "<p>It follows groups as wholes: of single people it says nothing, and no score of them is known.</p>"


@dataclass(frozen=True)
class Part:
    """Results under one heading: for each row of scores its page, and a name where that is not the sequence's."""

    title: str
    rows: list[Row]
    pages: list[Path]
    names: list[str]


@dataclass(frozen=True)
class Seen:
    """A scene that was tracked from its pictures: its results, a video by tracker, and how many frames it has."""

    part: Part
    films: dict[str, Path]
    frames: int
    seconds: float


def page(root: Path, seen: Seen, parts: list[Part]) -> str:
    """The page as HTML; root: the folder in which it will stand."""
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>flockscope demo</title><style>{STYLE}</style>'
    first = SEEN.format(frames=seen.frames) + _films(root, seen) + _table(seen.part, root)
    rest = "\n".join(_section(part, root) for part in parts)
    return f"{head}{INTRO}{first}{rest}</html>\n"


def _films(root: Path, seen: Seen) -> str:
    """The videos beside each other."""
    with_people = {name.split()[0] for name, row in zip(seen.part.names, seen.part.rows, strict=True) if _people(row)}
    shown = []
    for tracker, path in seen.films.items():
        about = (OF_PEOPLE if tracker in with_people else OF_GROUPS).format(tracker=escape(tracker))
        shown.append(FILM.format(film=escape(_link(path, root)), start=0.4 * seen.seconds, about=about))
    return f'<div class="films">{"".join(shown)}</div>'


def _section(part: Part, root: Path) -> str:
    note = "" if any(map(_people, part.rows)) else WITHOUT_PEOPLE
    return f"<h2>{escape(part.title)}</h2>{note}{_table(part, root)}"


def _people(row: Row) -> bool:
    """Are people scored, not groups alone?"""
    return math.isfinite(row.scores["HOTA"])


def _link(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def _table(part: Part, root: Path) -> str:
    """The shown scores of which any is known, with their mean and interval where there are several sequences."""
    keys = [key for key in SHOWN if any(math.isfinite(row.scores[key]) for row in part.rows)]
    rows = []
    for row, place, name in zip(part.rows, part.pages, part.names, strict=True):
        link = f'<a href="{escape(_link(place, root))}">{escape(name)}</a>'
        rows.append(_cells("td", [link, *(number(key, row.scores[key]) for key in keys)]))
    head = "<tr><th>sequence</th>" + "".join(map(_heading, keys)) + "</tr>"
    foot = ""
    if len({row.sequence for row in part.rows}) > 1:
        means = summary(part.rows)
        ends = [_interval(key, means[key]) for key in keys]
        foot = f"<tfoot>{_cells('td', ['mean<br><small>95 % interval</small>', *ends])}</tfoot>"
    table = f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody>{foot}</table>"
    return f'<div class="wide">{table}</div>'


def _heading(key: str) -> str:
    about = CATALOGUE[key]
    unit = f" [{about.unit}]" if about.unit not in ("1", "count") else ""
    return f'<th title="{escape(about.meaning)}">{escape(key)}{unit}</th>'


def _interval(key: str, mean: dict[str, float]) -> str:
    low, high = number(key, mean["low"], mean=True), number(key, mean["high"], mean=True)
    return f"{number(key, mean['mean'], mean=True)}<br><small>{low} to {high}</small>"


def _cells(tag: str, cells: list[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{cell}</{tag}>" for cell in cells) + "</tr>"
