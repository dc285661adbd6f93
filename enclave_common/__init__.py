"""Reading files, XML and YAML, terminal output and command lines: shared by the three packages, importing none of them.

files.py         a file that others wrote -> its bytes: regular files of bounded size only
new_file.py      a file that a person asked for, written whole or not at all
xml_tree.py      XML text -> elements with line numbers
yaml_reader.py   YAML text -> values or nodes with line numbers, within limits
shell_words.py   a command line as text -> its words, within a limit
command_line.py  options, version, slips of the fingers: what all commands do alike
words.py         numbers, lists and mistyped words in sentences
terminal.py      text that others chose -> text that is safe to show on a terminal; short paths; progress
environment.py   variables of our own environment, set for a while
dependencies.py  a Python package that is not installed -> one line
"""

VERSION = "0.1.0"
"""Of all three packages."""
