"""The tracker `blob` (González, Rowe, Andrade, Villanueva 2006): people as boxes or blobs."""
