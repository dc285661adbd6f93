"""The engine: runs a program in the order of its text over values that may be open."""
