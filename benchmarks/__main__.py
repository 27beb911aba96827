"""Tables that are shown in README and docs: measures them, and writes them into their pages.

python -m benchmarks results             writes all tables from their stored figures (docs/results/NAME.json)
python -m benchmarks results NAME…       measures these first: trackers
"""

from __future__ import annotations

from benchmarks.results import TABLES, measure, write
from benchmarks.support.options import new_parser


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("what", choices=["results"])
    parser.add_argument("name", nargs="*", choices=[*TABLES, []], metavar="NAME", help="tables to measure")
    given = parser.parse_args()
    for name in given.name:
        measure(name)
    for name in TABLES:
        write(name)


if __name__ == "__main__":
    main()
