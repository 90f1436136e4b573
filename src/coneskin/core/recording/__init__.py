"""File of a recording: chunks that are found again after damage, written by a recorder and read as a stream."""
