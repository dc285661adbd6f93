"""Reading files, XML and YAML, terminal output, command lines: shared by the three packages, importing none of them."""

VERSION = "0.1.0"
"""Of all three packages."""
