"""Virtual skin: a sensor in software, with faults on demand."""
