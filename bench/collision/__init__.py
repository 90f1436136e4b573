"""Benches of collisions: force in the physics engine, and push-in."""
