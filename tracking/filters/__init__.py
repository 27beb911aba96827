"""Building blocks of trackers: Kalman filters, assignment, track confirmation and deletion, connected components,
ellipse overlap.
"""
