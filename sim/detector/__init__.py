"""The simulated detector: which people it finds, where it reports them, and its false alarms."""
