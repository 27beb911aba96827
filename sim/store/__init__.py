"""The files of flockscope: stored sequences, truth, tracks and groups, with hashes that seal them."""
