"""Compare what runs with what was planned. Performs no I/O."""
