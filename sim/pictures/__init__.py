"""Pictures and videos of sequences and recordings: reading and decoding files, drawing, encoding and writing them."""
