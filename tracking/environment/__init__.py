"""The Gymnasium environment, its observations, and the episodes that searches play."""
