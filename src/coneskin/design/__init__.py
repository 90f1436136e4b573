"""Design of the sheets of a link: cut files, report and sensor.toml."""
