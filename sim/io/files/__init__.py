"""Files of any content: atomic writing, locks on folders, strict text files of numbers, Parquet tables and JSON."""
