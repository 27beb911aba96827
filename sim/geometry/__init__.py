"""Plane geometry: polygons, convex hulls, footprints of people, and a union-find for labelling connected sets."""
