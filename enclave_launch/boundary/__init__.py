"""What crosses the border of our process. The ground floor of all three packages: it imports none of them.

dependencies.py a Python package that is not installed -> one line
files.py        a file that others wrote -> its bytes: regular files of bounded size only
late_pattern.py a regular expression -> compiled at its first use
shell_words.py  a command line as text -> its words, in linear time
yaml_nodes.py   YAML text -> PyYAML's nodes: bounded depth, aliases that cannot multiply
terminal.py     text that others chose -> text that is safe to show on a terminal
"""
