"""From launch files to processes: visiting a description, the argument scan, events."""
