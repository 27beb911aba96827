"""Explains a scenario without simulating it: in words, as a plan in characters, as a plan in SVG."""
