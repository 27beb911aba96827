"""Reading and writing sequences: MOTChallenge, BIWI, CAVIAR, our own store, exports."""
