"""Bench of the tests: random mutations of the product, and which of them no test notices."""
