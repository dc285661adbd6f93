"""Records of what nodes asked of librcl: lines in, what each node asked for, manifests and comparisons out.

    lines.py      the text of a record → lines, and a complaint for each one that is lost, cut or unreadable
    assembly.py   lines → processes, nodes and their endpoints, each with what the launch started there
    asked.py      a recorded node → its own endpoints, without what libraries made for it
    written.py    a written and a final name → the name as the source means it
    origins.py    which parameter or argument a name came from, over all observations of a program
    learning.py   observations → the manifest of a program
    manifest.py   a learnt manifest ⇄ NoDL v2 text
    checking.py   manifests and inference held against records

All of it is pure. What writes the lines is ``enclave_launch/recording/recorder.c``; the supervisor adds lines of
its own that say what it started.
"""
