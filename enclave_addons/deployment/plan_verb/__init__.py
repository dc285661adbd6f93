"""The verbs of ``secure-plan`` that place a plan on hosts and export it."""
