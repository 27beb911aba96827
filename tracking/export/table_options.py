"""The options of tables of a run or a truth: what is counted, when, and which groups are left out."""

from __future__ import annotations

import re
from dataclasses import dataclass

from scenarios.errors import reject
from tracking.keyword_options import check_ranges, option

MINUTE = 60.0  # s
UNITS = {"": 1.0, "s": 1.0, "m": MINUTE, "min": MINUTE, "h": 3600.0}  # s


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """How the tables of a run or a truth are made."""

    # fmt: off
    margin: float | None = option(
        "Who is no farther from a line, or from the edges of a zone, is on none of its sides, m. None: 0.25 m, and at "
        "least 2.5 standard deviations of the position where its covariance is known.", None)
    every: float = option("Length of an interval of counts, s.", MINUTE, low=0.0)
    start: float = option("Start of the first interval, s.", 0.0, low=0.0)
    end: float | None = option("End of the last interval, s. None: the end of what was observed.", None)
    min_duration: float = option("Groups that exist for a shorter time in all are left out, s.", 0.0, low=0.0)
    # fmt: on

    def check(self) -> None:
        """Raises InputError for a value out of its range."""
        check_ranges(self)
        margin, end = self.margin, self.end
        reject(margin is not None and not margin >= 0, "", margin, "0 m or more", "correct it", "--margin")
        expected = f"a time after the start, {self.start:g} s"
        reject(
            end is not None and not end > self.start,
            "",
            f"{end or 0:g} s",
            expected,
            "correct --start or --end",
            "--end",
        )


def seconds_of(text: str, option: str) -> float:
    """Returns the seconds of a text such as "10s", "1m", "1.5h" or "10". Raises InputError for any other."""
    found = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)\s*(s|m|min|h)?", text.strip())
    reject(found is None, "", repr(text), "seconds, or a number with s, m or h", "write 10s or 1m", option)
    assert found is not None
    return float(found[1]) * UNITS[found[2] or ""]
