"""The tracker `stereo` (Hoshikawa, Hashimoto, Moro, Terabayashi, Umeda 2011): groups of people tracked in space.

tracker: the class, the order of a frame, the report; points: from pictures or detections to points in space;
space_group: a group, its filter and its points; group_life: births, merging, splitting, losses.
"""
