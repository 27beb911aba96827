"""Plane geometry: polygons and convex hulls."""
