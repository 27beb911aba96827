"""Readers for recordings in public formats: MOTChallenge, BIWI, CAVIAR, video files, and Tsai's camera calibrations."""
