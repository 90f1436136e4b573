"""Runs for other programs: tables as CSV, Parquet and NumPy files, and MCAP for Foxglove."""
