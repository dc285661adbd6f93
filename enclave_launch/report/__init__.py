"""The plan for people and for programs. Everything here only reads."""
