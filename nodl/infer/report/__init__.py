"""What inference found, written down: JSON (a contract), text, SROS2 policy, NoDL v1 and v2."""
