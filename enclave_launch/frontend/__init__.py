"""Front ends: the text of a launch file in, a tree of elements out. Reads files; evaluates nothing."""
