"""Compare what runs with what was planned. Performs no I/O.

expected.py   the dry run's JSON → what the plan expects in one domain
finding.py    one difference, how sure it is, and its words
compare.py    plan and graph → findings
steady.py     findings over time → those that stand, each reported once
"""
