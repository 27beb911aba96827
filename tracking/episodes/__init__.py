"""Episodes: a tracker with its parameters plays one sequence and is scored. How they are played, and their cache."""
