"""How each kind of statement and expression runs: who is imported here is known to the machine."""

from nodl.infer.cpp.running import assignments, calls, expressions, loops, operators, statements

__all__ = ["assignments", "calls", "expressions", "loops", "operators", "statements"]
