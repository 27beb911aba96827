"""Pictures and videos: reading, writing, decoding, encoding."""
