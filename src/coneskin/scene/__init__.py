"""Scene file: its values, its reader, its checks, and the guard's parts built from it."""
