"""Benches of the firmware in the emulator."""
