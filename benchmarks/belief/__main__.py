"""Who belongs together, by the rule, by the belief and by SPENCER's relations.

    python -m benchmarks.belief recordings [--data FOLDER]
    python -m benchmarks.belief suites [--scenes standard friends-meet …]
    python -m benchmarks.belief decisions [--scenes standard …] [--seeds 20000:20001] [--data FOLDER]
    python -m benchmarks.belief calibration [--scenes streets] [--seeds 20000:20001] [--inputs truth boxes …]
        [--out CHART.svg]
    python -m benchmarks.belief ablation [--seeds 30000:30002] [--check 20000:20002]
    python -m benchmarks.belief noise [--seeds 3] [--before FILE.toml] [--data FOLDER]
    python -m benchmarks.belief queues [--seeds 20000:20006] [--before FILE.toml]
    python -m benchmarks.belief inputs [PART …] [--suites standard …] [--truth-seeds 20000:20002] …
        [--before FILE.toml|FILE.json] [--json FILE.json]
    python -m benchmarks.belief cost [--people 30 300] [--rounds 3]
    python -m benchmarks.belief pets [--before FILE.toml] [--data FOLDER]

The docstrings of benchmarks/belief/*.py say what each mode prints.
--grouping FILE.toml: another belief.
--before FILE.toml: a second belief, whose scores stand beside; differences are paired.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from benchmarks.support.options import add_data, add_seeds, new_parser, one_thread, seed_range
from scenarios.errors import InputError
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import grouping_of


def main() -> None:
    parser = new_parser(__doc__)
    modes = parser.add_subparsers(dest="mode", required=True, metavar="MODE")
    for name, (options, _) in MODES.items():
        mode = modes.add_parser(name)
        mode.add_argument("--grouping", default="belief", metavar="FILE.toml", help="another belief")
        options(mode)
    args = parser.parse_args()
    args.grouping = belief_of(args.grouping, "--grouping")
    MODES[args.mode][1](args)


def belief_of(source: str, option: str) -> Belief:
    """Returns the belief of a file, or the default one. Raises InputError for another grouping."""
    found = grouping_of(source)
    if not isinstance(found, Belief):
        remedy = "name a file of `flockscope fit grouping`"
        raise InputError(file=source, place=option, got="the baseline rule", expected="a belief", remedy=remedy)
    return found


def second_of(args: argparse.Namespace) -> Belief | None:
    """Returns the belief of --before, None without it."""
    return None if args.before is None else belief_of(args.before, "--before")


def count(text: str) -> int:
    """Returns a number of at least 1. Raises ArgumentTypeError, which argparse reports, otherwise."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number of at least 1, got {text!r}")
    return int(text)


def add_scenes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--scenes", nargs="+", metavar="NAME", help="scenarios, suites or *.toml files")
    add_seeds(parser, "20000:20001")


def add_before(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--before", metavar="FILE.toml", help="a second belief")


def recordings(args: argparse.Namespace) -> None:
    from benchmarks.belief.recordings import recordings

    recordings(args.data, args.grouping)


def suites(args: argparse.Namespace) -> None:
    from benchmarks.belief.suites import suites

    suites(args.scenes or ["standard", "friends-meet"], args.seeds, args.grouping)


def decision_options(parser: argparse.ArgumentParser) -> None:
    add_scenes(parser)
    add_data(parser)


def decisions(args: argparse.Namespace) -> None:
    from benchmarks.belief.decisions import decisions

    decisions(args.scenes or ["standard", "friends-meet", "streets"], args.seeds, args.grouping, args.data)


def ablation_options(parser: argparse.ArgumentParser) -> None:
    add_seeds(parser, "20000:20001")
    parser.add_argument("--check", type=seed_range, default="20000:20002", metavar="A:B", help="test seeds")
    add_data(parser)


def ablation(args: argparse.Namespace) -> None:
    from benchmarks.belief.ablation import ablation

    ablation(args.seeds, args.check, args.data)


def calibration_options(parser: argparse.ArgumentParser) -> None:
    add_scenes(parser)
    add_data(parser)
    parser.add_argument("--inputs", nargs="+", metavar="INPUT", help="a table by input: truth, .1/.3, .15/.6, boxes")
    parser.add_argument("--out", type=Path, metavar="CHART.svg", help="reliability plot")


def calibration(args: argparse.Namespace) -> None:
    scenes = args.scenes or ["standard"]
    if args.inputs is None:
        from benchmarks.belief.calibration import calibration

        calibration(scenes, args.seeds, args.grouping, args.out)
    else:
        from benchmarks.belief.calibration_by_input import calibration_by_input

        calibration_by_input(scenes, args.seeds, args.grouping, args.inputs, args.data)


def noise_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=count, default=3, metavar="N", help="draws of the errors, seeds 0 to N - 1")
    add_before(parser)
    add_data(parser)


def noise(args: argparse.Namespace) -> None:
    from benchmarks.belief.noise import noise

    noise(args.data, args.seeds, args.grouping, second_of(args))


def queue_options(parser: argparse.ArgumentParser) -> None:
    add_seeds(parser, "20000:20006")
    add_before(parser)


def queues(args: argparse.Namespace) -> None:
    from benchmarks.belief.queues import queues

    queues(args.seeds, args.grouping, second_of(args))


def input_options(parser: argparse.ArgumentParser) -> None:
    from benchmarks.belief.inputs import PARTS

    parser.add_argument("part", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--suites", nargs="+", metavar="NAME", help="in place of the suites of each part")
    for name, part in PARTS.items():
        add_seeds(parser, part.seeds, f"--{name}-seeds", f"{name}: ")
    parser.add_argument("--before", metavar="FILE", help="a second belief, *.toml, or scores stored by --json")
    parser.add_argument("--json", type=Path, metavar="FILE.json", help="stores the scores of each sequence")
    add_data(parser)


def inputs(args: argparse.Namespace) -> None:
    from benchmarks.belief.inputs import PARTS, inputs, stored_scores

    unknown = set(args.part) - PARTS.keys()
    if unknown:
        remedy = "name some of them, or none for all"
        raise InputError(place="PART", got=min(unknown), expected=", ".join(PARTS), remedy=remedy)
    seeds = {name: getattr(args, f"{name}_seeds") for name in args.part or PARTS}
    stored = args.before is not None and args.before.endswith(".json")
    before = stored_scores(args.before) if stored else second_of(args)
    inputs(seeds, args.suites, args.data, args.grouping, before, args.json)


def cost_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--people", nargs="+", type=count, default=[30, 300], help="numbers of people in view")
    parser.add_argument("--rounds", type=count, default=3, help="runs of which the best counts")


def cost(args: argparse.Namespace) -> None:
    from benchmarks.belief.cost import cost

    cost(args.people, args.rounds, args.grouping)


def pets_options(parser: argparse.ArgumentParser) -> None:
    add_before(parser)
    add_data(parser)


def pets(args: argparse.Namespace) -> None:
    from benchmarks.belief.pets import pets

    pets(args.data, args.grouping, second_of(args))


Mode = tuple[Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace], None]]
MODES: dict[str, Mode] = {
    "recordings": (add_data, recordings), "suites": (add_scenes, suites), "decisions": (decision_options, decisions),
    "calibration": (calibration_options, calibration), "ablation": (ablation_options, ablation),
    "noise": (noise_options, noise), "queues": (queue_options, queues), "inputs": (input_options, inputs),
    "cost": (cost_options, cost), "pets": (pets_options, pets),
}  # fmt: skip


if __name__ == "__main__":
    one_thread()
    main()
