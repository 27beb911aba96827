"""The tracker `joint` (DEEPER-JIGT: Bazzani, Cristani, Murino 2012): individuals and groups by a decentralised filter.

tracker: the class and the order of a frame; decentralised_filter: Algorithm 1; distributions: the four distributions of
Table 1; individuals: the proposal and eq. 3; group_proposal_kernels: motion and events of groups;
partition_labels_kernels: labels, cluster validity; people: association, births, losses; report: the output.
"""
