"""The tracker `group-pda` (Gennari & Hager, CVPR 2004): groups of people tracked as wholes.

tracker: the class and the order of a frame; association: gate, masses, update; splitting, merging, births_and_losses:
what changes the set of groups; event_onsets: when a merge or split began; report: the output.
"""
