"""The work of each command. `app/cli.py` declares the commands, `app/command_options.py` their options."""
