"""Writes the parts of README and docs that are made from the code and the stored results.

    python -m benchmarks pages [--check]

A part stands between `<!-- generated: NAME -->` or `<!-- generated: NAME ARGUMENT -->` and `<!-- end -->`, each on a
line of its own. PARTS in `benchmarks.pages.parts` has the names, places.toml the modules. --check names
the pages that differ from the code, writes nothing, and ends with exit code 1 if there are any.
"""

from __future__ import annotations

import sys

from benchmarks.pages.blocks import differing, with_parts
from benchmarks.results import pages
from benchmarks.support.options import new_parser


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if a page differs")
    if parser.parse_args().check:
        found = differing()
        print("\n".join(found) or "all pages are as the code")
        return int(bool(found))
    for page in pages():
        text = page.read_text(encoding="utf-8")
        if (new := with_parts(text)) != text:
            page.write_text(new, encoding="utf-8")
            print(page)
    return 0


if __name__ == "__main__":
    sys.exit(main())
