"""The trackers `relational` and `particle` (Cattelani, Manfredotti, Messina 2012): people and who walks with whom.

tracker: the classes and the order of a frame; transition: motion and relations; sensor: weights; association_sums: the
sum over mappings of people to detections; slots: births, deaths, ids; report: the output.
"""
