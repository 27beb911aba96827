"""Where the parts of the pages come from: modules, configs, and the public names by section of the page *Python*.

Whoever renames a module changes its place here; pages name parts only.
"""

from __future__ import annotations

DOCSTRINGS = {
    "breaking-points": ("tracking.stress.axes", ""),
    "causes": ("tracking.errors.causes", "cause"),
    "costs": ("tracking.errors.found", ""),
    "errors-of-groups": ("tracking.errors.groups", "kind"),
    "errors-of-people": ("tracking.errors.people", "kind"),
    "failures": ("tracking.stress.failures", "failure"),
    "removed": ("tracking.stress.reductions", "kind"),
    "repairs": ("tracking.errors.repairs", ""),
    "smallest-scene": ("tracking.stress.minimize", ""),
    "sweep": ("tracking.stress.sweep", ""),
    "worst-scenes": ("tracking.stress.worst_scenes", ""),
}
"""Module, and the heading of the first column of its tables if that holds names, else ""."""

CONFIGS = {
    "blob": "tracking.papers.blob.config:BlobConfig",
    "foreground": "tracking.detect.background_settings:BackgroundSettings",
    "group-pda": "tracking.papers.group_pda.config:GroupPdaConfig",
    "joint": "tracking.papers.joint.config:JointConfig",
    "link-rule": "tracking.grouping.link_rule:LinkRule",
    "relational": "tracking.papers.relational.config:RelationalConfig",
    "stereo": "tracking.papers.stereo.config:StereoConfig",
}

PUBLIC = ("scenarios", "sim", "tracking", "tracking.scoring")
"""Packages of which everything in `__all__` must stand on the page."""

NAMES = {
    "scenarios": (
        "scenarios.load",
        "scenarios.sensor_settings",
        "scenarios.loading.resolve.Entry",
        "scenarios.loading.toml_files.Setting",
    ),
    "files": (
        "sim.simulate",
        "sim.replay",
        "sim.dataset.generate.generate",
        "tracking.recordings.source.open_source",
        "tracking.recordings.track_texts.read_tracks",
        "sim.store.track_files.write_tracks",
        "sim.dataset.splits.is_real",
        "sim.dataset.replay.Cut",
        "sim.dataset.generate.Folders",
        "sim.workers.start.WorkerOptions",
    ),
    "tracking": (
        "tracking.track",
        "tracking.group",
        "tracking.evaluate",
        "tracking.compare",
        "tracking.tune",
        "tracking.scoring.evaluate",
        "tracking.scoring.score_arrays",
        "tracking.scoring.pooled",
        "tracking.episodes.episode.play",
    ),
    "results": (
        "tracking.running.run.TrackingRun",
        "tracking.export.tidy_tables.TidyTables",
        "tracking.export.tidy_tables.TidyTable",
        "tracking.export.tidy_tables.truth_tables",
        "tracking.scoring.evaluation.Scores",
        "tracking.comparison.ComparedRuns",
        "tracking.ranking.Ranking",
        "tracking.tuning.result.TuningResult",
    ),
    "tracker": (
        "sim.types.Tracker",
        "tracking.config.Config",
        "tracking.config.param",
        "tracking.config.Param",
        "tracking.running.time_limit.TimeLimited",
        "tracking.grouping.belief.Belief",
        "tracking.grouping.link_rule.LinkRule",
    ),
    "types": (
        "sim.types.Frame",
        "sim.types.Detections",
        "sim.types.Tracks",
        "sim.types.Groups",
        "sim.types.GroupEvent",
        "sim.types.Context",
        "sim.types.Camera",
        "sim.types.Scene",
        "sim.types.Truth",
        "sim.types.FrameTruth",
        "sim.types.PixelTruth",
        "sim.types.Near",
        "sim.types.Order",
        "sim.types.Unscored",
        "sim.types.Motion",
        "sim.types.States",
        "sim.types.Stairs",
        "sim.types.Sequence",
    ),
    "environment": ("tracking.environment.env.TuningEnv",),
    "errors": ("scenarios.errors.FlockscopeError", "scenarios.errors.InputError", "scenarios.errors.WorkError"),
}
"""Public names by section of docs/reference/python.md."""

WITHOUT_METHODS = (
    "sim.dataset.generate.Folders",
    "tracking.config.Param",
    "tracking.grouping.belief.Belief",
    "tracking.grouping.link_rule.LinkRule",
    "tracking.running.time_limit.TimeLimited",
)
"""Classes whose methods are not for users."""
