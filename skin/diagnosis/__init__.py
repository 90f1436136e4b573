"""Diagnosis of a stream of bytes: what is wrong with it, in plain words, and what to do."""
