"""What is drawn of a scene: solids of the arm, sheets on them, and what their colours mean."""
