"""The work of each command; tracking/app/cli.py declares their options."""
