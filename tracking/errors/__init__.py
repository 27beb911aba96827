"""Errors of a tracker: what went wrong in which frames, to whom, why, and what it costs (`tracking.errors.found`)."""
