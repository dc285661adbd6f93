"""Command lines: arguments, one call of the library, an exit status."""
