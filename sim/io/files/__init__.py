"""Files in general: atomic writing, locks, numeric text, Parquet and JSON."""
