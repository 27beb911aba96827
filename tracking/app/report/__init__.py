"""The report on several trackers: what it shows, and the page."""
