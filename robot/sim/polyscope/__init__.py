"""PolyScope, the user interface of a UR controller, as far as clients command it: programs, dashboard, robot API."""
