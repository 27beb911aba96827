"""The trackers `relational` and `particle` (Cattelani, Manfredotti, Messina 2012): people and who walks with whom.

tracker: the filter and the order of a frame; transition_kernels: motion, and who walks with whom;
sensor: weights; association_sums_kernels: sums over mappings of people to detections; particle_set: weights of people,
estimates, resampling, relations; occluders: who is hidden from the camera; config: the parameters.
"""
