"""Groups, and events of groups, for the person tracks of any tracker.

Module grouped_tracks fills in groups and events (`with_groups`, `derive`); link_rule decides which two people belong
together; group_labels turns links into groups over time; group_events makes the merge, split, enter and leave
events; tracks_table holds a sequence's tracks as arrays.
"""
