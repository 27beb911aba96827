"""Sphinx configuration of the site (`make docs`). `python -m benchmarks pages` makes the parts that come from the code.

Pages are written for a code host. The site differs in five things: links to README, CONTRIBUTING and CHANGELOG lead to
their pages, commands are wrapped, intervals are not, `<!-- pages TITLE: a b -->` is a part of the navigation, and the
picture NAME.jpg below `<!-- replay -->` opens the replay page of the data in docs/start/NAME.json. In the pages that
Sphinx has made, no command is wrapped inside an option, pictures have a size, and captions a level.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from PIL import Image

from tracking.app.replay_page.page import page_html, script_json

ROOT = Path(__file__).resolve().parents[1]

project = "flockscope"
author = "flockscope maintainers"
release = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
extensions = ["myst_parser"]
root_doc = "index"
html_theme = "furo"
html_title = f"flockscope {release}"
html_show_sphinx = False
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["command-builder.js", "scrolling.js"]
highlight_language = "none"
smartquotes = False  # They would make a dash of `--`.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "html_image"]

OUTSIDE = re.compile(r"\]\((?:\.\./)+(README|CONTRIBUTING|CHANGELOG)\.md")
PAGE_OF = {"README": "index.md", "CONTRIBUTING": "contributing.md", "CHANGELOG": "changelog.md"}
INTERVAL = re.compile(r"(?<=\d \[)([-+]?[\d.]+,) (?=[-+]?[\d.]+\])|(?<=\d\]) (?=\*)")
COMMANDS = re.compile(r"^```\n(?=(flockscope|python|pip|make) )", re.MULTILINE)
REPLAY = re.compile(r"^<!-- replay -->\n!\[(.*)\]\((\w+)\.jpg\)$", re.MULTILINE)
SH = re.compile(r'<div class="highlight-sh.*?</pre>', re.DOTALL)
OPTION = re.compile(r"(?<![\w-])--[\w-]+")
PICTURE = re.compile(r'<img ([^>]*?src="([^"]+)")')
PAGES = re.compile(r"^<!-- pages (\w+): (.*) -->$", re.MULTILINE)


def for_the_site(text: str) -> str:
    """Returns the text of a page as the site shows it."""
    text = OUTSIDE.sub(lambda found: f"](/{PAGE_OF[found[1]]}", text)
    text = COMMANDS.sub("```sh\n", INTERVAL.sub("\\1\N{NO-BREAK SPACE}", text))
    replay = r'<a href="../_static/replay-\2.html"><img src="\2.jpg" alt="\1"><br>Open the replay</a>'
    text = REPLAY.sub(replay, text)
    return PAGES.sub(lambda found: navigation(*found.groups()), text)


def navigation(title: str, pages: str) -> str:
    """Returns a table of contents that only the navigation shows."""
    return "\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *pages.split(), "```"])


def finished(html: str, folder: Path) -> str:
    """Returns a page that Sphinx has made as the site has it. folder: where it lies."""
    html = SH.sub(lambda block: OPTION.sub(r'<span class="option">\g<0></span>', block[0]), html)
    html = html.replace('class="caption" role="heading"', 'class="caption" role="heading" aria-level="2"')
    return PICTURE.sub(lambda found: f"<img {size(folder / found[2])}{found[1]}", html)


def size(picture: Path) -> str:
    """Returns the size of a picture in pixels as attributes, "" for a drawing; with them the page keeps its place."""
    if picture.suffix not in (".jpg", ".png", ".webp"):
        return ""
    with Image.open(picture) as opened:
        return f'loading="lazy" width="{opened.width}" height="{opened.height}" '


def setup(app: Any) -> None:
    """Sphinx calls this."""

    def read(_app: Any, _name: str, source: list[str]) -> None:
        source[0] = for_the_site(source[0])

    def finish(app: Any, error: Exception | None) -> None:
        if error:
            return
        for page in Path(app.outdir).rglob("*.html"):
            page.write_text(finished(page.read_text(encoding="utf-8"), page.parent), encoding="utf-8")
        for path in sorted((ROOT / "docs" / "start").glob("*.json")):
            data = json.loads(path.read_text(encoding="utf-8"))
            page = page_html(data["name"], script_json(data))
            (Path(app.outdir) / "_static" / f"replay-{path.stem}.html").write_text(page, encoding="utf-8")

    app.connect("source-read", read)
    app.connect("build-finished", finish)
