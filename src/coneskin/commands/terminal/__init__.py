"""What a command shares with the terminal it runs in: a person who answers, lines typed, signals that end it."""
