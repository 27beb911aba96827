"""From files and names to checked scenarios: TOML, `extends`, `--set`, suites, error messages."""
