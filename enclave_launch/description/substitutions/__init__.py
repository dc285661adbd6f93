"""Substitutions, by where their value comes from."""
