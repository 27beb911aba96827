"""The scripts: scenario files, their strict form, the catalogue and the suites. Imports nothing of ours."""
