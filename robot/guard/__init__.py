"""Guard: its decisions (``core``, ``arm_supervisor``) and the live loop that joins skin and arm (``loop``)."""
