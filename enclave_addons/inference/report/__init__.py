"""What inference found, written down: JSON (a contract), text, NoDL v2."""
