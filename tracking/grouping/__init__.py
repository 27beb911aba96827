"""Groups and events of anybody's person tracks."""
