"""Pages whose parts are made from the code: `<!-- generated: NAME -->` to `<!-- end -->`."""

from __future__ import annotations

import re

from benchmarks.pages.parts import PARTS, ROOT
from benchmarks.results import OLDER, pages

BLOCK = re.compile(r"^(<!-- generated: (\S+) ?(\S*) -->\n).*?^(<!-- end -->)$", re.DOTALL | re.MULTILINE)


def with_parts(text: str) -> str:
    """Returns the text of a page with its parts made anew. Raises KeyError if a block names no part."""
    return BLOCK.sub(lambda m: f"{m[1]}\n{PARTS[m[2]](*filter(None, [m[3]])).strip()}\n\n{m[4]}", text)


def differing() -> list[str]:
    """Returns the paths of the pages of which a part differs from the code, but for marks of what is older than it."""
    texts = {page: page.read_text(encoding="utf-8").replace(OLDER, "") for page in pages()}
    return [p.relative_to(ROOT).as_posix() for p, text in texts.items() if with_parts(text).replace(OLDER, "") != text]
