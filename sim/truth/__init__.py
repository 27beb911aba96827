"""What is true of a crowd, measured from its motion: groups, ids, events, and whether orders were fulfilled."""
