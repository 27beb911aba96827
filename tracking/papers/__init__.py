"""The trackers of five papers, one package each; the first line of each package names its paper."""
