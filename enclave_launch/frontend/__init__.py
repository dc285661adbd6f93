"""Front ends: the text of a launch file in, a tree of elements out. Reads files; evaluates nothing.

    launch_file.py            path -> text -> parsed tree, read and parsed once per file version
    xml_tree.py               text -> tree with line numbers; refuses what only an attacker writes
    substitution_grammar.py   the ``$(...)`` language: text <-> templates
    libyaml.py                PyYAML for the code of launch files, in C where that gives the same
    python_file.py            runs a Python launch file: foreign code, alone in its file, behind a switch
    error_location.py         exception -> file, line and element

The classes that Python code sees (``launch.frontend.Parser``, ``launch_xml.Entity``...) are in
``description`` and use these modules.
"""
