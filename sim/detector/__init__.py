"""The simulated detector: which people it detects, where it reports them, and its false alarms."""
