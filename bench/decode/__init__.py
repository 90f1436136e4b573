"""Benches of the decoder, against plants that share no code with it."""
