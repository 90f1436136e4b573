"""What if: many runs with other settings, judged by the touches that there really were."""
