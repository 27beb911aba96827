"""Scores of people, groups and events; imports numpy and scipy only."""
