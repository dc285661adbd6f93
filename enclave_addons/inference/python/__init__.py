"""Inference of Python: what a name, a class, a call and a literal mean. The kernel does the rest."""
