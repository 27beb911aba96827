"""Draws tracks and truth, on a plan of the ground or over a picture."""
