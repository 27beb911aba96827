"""Explains a scenario without simulating it: in words, and as a plan in SVG."""
