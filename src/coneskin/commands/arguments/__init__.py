"""Options of commands that have many, and the values that they describe."""
