"""Actions, by what they are about."""
