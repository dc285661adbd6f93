"""What runs, held against what was planned. Pure: a plan and a graph in, findings out.

expected.py   the dry run's JSON → what the plan expects in one domain
finding.py    one difference, how sure it is, and how it is told
compare.py    plan and graph → findings
steady.py     findings over time → those that stand, each told once
"""
