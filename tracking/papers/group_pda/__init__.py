"""The tracker `group-pda` (Gennari & Hager, CVPR 2004): groups of people tracked as wholes.

tracker: the class, the order of a frame, the output; association: gate, masses, update; merging_and_splitting,
births_and_losses: what changes the set of groups.
"""
