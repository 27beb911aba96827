"""Files of others, read as sequences: MOTChallenge, BIWI, CAVIAR, Tsai calibrations, videos."""
