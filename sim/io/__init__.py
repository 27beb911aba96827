"""Reading and writing sequences: recordings in public formats, our own store, exports."""
