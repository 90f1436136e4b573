"""Motion of the simulated arm: its state, moves, blends and paths, in control cycles."""
