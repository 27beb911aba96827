"""The report on several trackers: what it shows, its charts, and the page."""
