"""The truth of a simulated crowd, measured from its motion: groups, ids, events, and whether orders came true."""
