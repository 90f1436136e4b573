"""What a person does at the skin: touch marks, calibrate, examine, listen to the line."""
