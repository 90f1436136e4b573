"""Stop supervision: stop monitor, standstill monitor, backup stop, standstill hold and guard watchdog."""
