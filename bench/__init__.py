"""Benches of coneskin: `python -m bench` lists them, `python -m bench NAME` runs one. Results: bench/RESULTS.md."""
