"""What crosses the border of our process. The ground floor of all three packages: it imports none of them.

files.py        a file that others wrote -> its bytes: regular files of bounded size only
yaml_nodes.py   YAML text -> PyYAML's nodes: bounded depth, aliases that cannot multiply
terminal.py     text that others chose -> text that is safe to show on a terminal
"""
