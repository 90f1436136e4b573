"""What every room stands on: errors, findings, channels, files, text and recordings."""
