"""The tracker `stereo` (Hoshikawa, Hashimoto, Moro, Terabayashi, Umeda 2011): groups of people tracked in space.

tracker: the class and the order of a frame; picture_points, point_links: from pictures or detections to points in
space; association, births_and_losses, merging, splitting: the steps of a frame; space_group: a group and its filter;
report: the output.
"""
