"""Readers for recordings in public formats: MOTChallenge, BIWI, CAVIAR, videos, and Tsai's calibrations."""
