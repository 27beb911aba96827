"""Building blocks of trackers: Kalman filters, assignment, track uncertainty, connected components, ellipse overlap."""
