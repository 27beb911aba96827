"""The commands: everything is imported here, nothing imports this."""
