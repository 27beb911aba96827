"""Plane geometry: polygons, convex hulls, footprints, and joining numbers into sets."""
