"""From a sequence to tracks: inputs chosen, the tracker prepared, each step checked, and what run.json tells of it."""
