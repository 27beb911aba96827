"""The tracker `stereo` (Hoshikawa, Hashimoto, Moro, Terabayashi, Umeda 2011): groups of people tracked in space.

tracker: the class and the order of a frame; picture_points, point_links: from pictures or detections to points in
space; association, initial_grouping, merging, splitting: the steps of the paper; space_group: a group and its filter;
births_and_losses: what is ours; report: the output.
"""
