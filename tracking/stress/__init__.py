"""Stress: a tracker's scores as a scene gets harder, and where they break (`tracking.stress.sweep`)."""
