"""What crosses the border of our process. The ground floor of all three packages: it imports none of them.

files.py         a file that others wrote -> its bytes: regular files of bounded size only
new_file.py      a file that a person asked for, written whole or not at all
xml_tree.py      XML text -> elements with line numbers
yaml_nodes.py    YAML text -> PyYAML's nodes: bounded depth, aliases that cannot multiply
shell_words.py   a command line as text -> its words, in linear time
command_line.py  options, version, slips of the fingers: what all commands do alike
words.py         numbers, lists and mistyped words in sentences
terminal.py      text that others chose -> text that is safe to show on a terminal; short paths; progress
environment.py   variables of our own environment, set for a while
dependencies.py  a Python package that is not installed -> one line
public_names.py  the names that a package offers, imported when first used
light.py         typing's names, value types and patterns at little cost for start-up
"""

VERSION = "0.1.0"
"""Of all three packages."""
