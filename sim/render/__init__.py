"""Pictures of a motion: background, people, shadows, light, noise, and the truth of each pixel."""
