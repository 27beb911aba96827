"""The world: crowds, cameras, sensors, truth, and how sequences are stored and read."""
