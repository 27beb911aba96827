"""From frames to scores: detectors, trackers, grouping, scoring, the commands."""
