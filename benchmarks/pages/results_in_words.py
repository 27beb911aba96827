"""The sentences of README that have figures, made from the stored tables of results."""

from __future__ import annotations

from typing import Any

from benchmarks import results

RECORDINGS = {"PETS09-S2L1": "PETS", "TUD-Campus": "TUD", "AVG-TownCentre": "TownCentre"}


def stored(table: str, title: str = "") -> dict[str, Any]:
    """Returns the stored table whose title begins so: its title, columns and rows of cells."""
    tables = results.stored(results.tables()[table])["tables"]
    return next(t for t in tables if t["title"].startswith(title))


def rows(table: str, title: str = "") -> list[dict[str, str]]:
    """Returns the rows of that table by column."""
    found = stored(table, title)
    return [dict(zip(found["columns"], cells, strict=True)) for cells in found["rows"]]


def number(cell: str, digits: int = 2) -> str:
    """Returns the first number of a cell, rounded."""
    found = results.NUMBER.search(cell)
    assert found is not None, cell
    return f"{float(found[0]):.{digits}f}"


def signed(cell: str) -> str:
    """Returns the first number of a cell with its sign, and the star if it has one."""
    return f"{float(number(cell, 3)):+.2f}{' *' * cell.endswith('*')}".replace("-", "−")


def link(page: str, *tables: str) -> str:
    """Returns the link to the page with the tables; it says if one of them is older than the code."""
    older = any(results.is_stale(results.tables()[table]) for table in tables)
    return f"([table]({page}){results.OLDER if older else ''})"


def comparisons(docs: str = "docs/") -> str:
    """People, groups and speed beside other software. docs: the folder of the docs, from the page."""
    return "\n".join([_people(), _groups(), _speed()]).replace("](docs/", f"]({docs}")


def _people() -> str:
    """`blob` beside trackers of individuals, on simulated and on real boxes."""
    parts = []
    for title in ("Scenes with occlusion", *RECORDINGS):
        ours, *others = rows("peers", title)
        others = [row for row in others if not row["tracker"].startswith("`blob`")]
        best = max(others, key=lambda row: float(row["HOTA"]))
        parts.append((ours, best, len({row["tracker"].removesuffix(", tuned") for row in others})))
    (ours, best, count), *real = parts
    listed = ", ".join(
        f"{n} {number(a['HOTA'])} and {number(b['HOTA'])}"
        for n, (a, b, _) in zip(RECORDINGS.values(), real, strict=True)
    )
    return (
        "- **People**: on 24 simulated scenes with occlusion, from the same boxes, `blob` reaches HOTA"
        f" {number(ours['HOTA'])}, the best of {count} trackers of other libraries ({best['tracker']})"
        f" {number(best['HOTA'])}; group F1 (people in the right groups) {number(ours['group_F1'])} and"
        f" {number(best['group_F1'])}. HOTA of both from boxes of recordings: {listed}"
        f" {link('docs/results/trackers.md#beside-other-trackers', 'peers')}."
    )


def _groups() -> str:
    """The belief of who belongs together beside SPENCER."""
    found = {row["recording"]: row for row in rows("belonging-recordings")}
    listed = " and ".join(
        f"{number(found[name]['belief'])} on {name} (SPENCER: {number(found[name]['SPENCER'])})"
        for name in ("seq_hotel", "zara01")
    )
    return (
        f"- **Groups**: who walks with whom, from people's positions, pairwise F1 on two recordings: {listed};"
        f" SPENCER is the other open tool for this {link('docs/results/belonging.md', 'belonging-recordings')}."
    )


def _speed() -> str:
    """Simulator beside JuPedSim, scores beside TrackEval."""
    simulated = rows("simulator")
    ratios = [number(row["ratio (range)"], 1) for row in simulated]
    faster = next(
        row["times ours"]
        for row in rows("scoring")
        if row["HOTA, CLEAR, Identity of 1000 frames × 30 people"] == "TrackEval"
    )
    return (
        f"- **Speed**: the simulator makes {min(ratios)} to {max(ratios)} times as many steps a CPU second as"
        f" JuPedSim, with {simulated[0]['people']} to {simulated[-1]['people']} people;"
        " HOTA, CLEAR and Identity equal TrackEval's and"
        f" take a {number(faster, 0)}th of its time {link('docs/results/cost.md', 'simulator', 'scoring')}."
    )


def tuning() -> str:
    """What tuning earns, and where it earns nothing."""
    found = {row["tracker"]: row for row in rows("tuning", "HOTA minus")}
    others, ours = found["mean of the libraries"], found["blob"]
    ways = "standard", "--like", "checked there", "labels of another", "itself"
    gains, own = ([signed(one[way]) for way in ways] for one in (others, ours))
    return (
        f"What it earns on {len(RECORDINGS)} recordings, mean HOTA: {len(found) - 3} trackers of other libraries"
        f" {gains[0]} if tuned on standard scenes, {gains[1]} on scenes like the recording without its labels,"
        f" {gains[2]} with the labels of its first third, where that is no worse there, {gains[3]} with the labels of"
        f" another one; draws on the recording itself find {gains[4]}. `blob`, whose defaults are tuned already,"
        f" {', '.join(own[:-1])} and {own[-1]} {link('docs/results/tuning.md', 'tuning')}.\n\n{_adapting()}"
    )


def _adapting() -> str:
    """What a policy earns where the detector changes, and where nothing changes."""
    titles = [table["title"] for table in results.stored(results.tables()["adaptation"])["tables"]]
    trackers = [title.partition(",")[0] for title in titles if ", standard: " in title]
    gains = {
        suite: " and ".join(
            signed(row["beside the best constant"])
            for tracker in trackers
            for row in rows("adaptation", f"{tracker}, {suite}: ")
            if row["parameters"] == "policy"
        )
        for suite in ("drift", "drift-other", "standard")
    }
    names = " and ".join(f"`{tracker}`" for tracker in trackers)
    return (
        "What parameters earn that a [policy](docs/reference/tuning.md#policies) changes while a camera runs, beside"
        f" the best constant, {names}: {gains['drift']} where the detector changes, {gains['drift-other']} where it"
        f" changes in ways not trained on, {gains['standard']} where nothing changes; * is a sure difference"
        f" {link('docs/results/tuning.md#does-it-pay-to-change-parameters-while-a-camera-runs', 'adaptation')}."
    )
