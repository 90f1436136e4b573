"""Terminal of a command: a person who answers, lines typed, signals that end it."""
