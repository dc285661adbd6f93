"""The report as one HTML file that works without network.

page.py     values -> the page: everything that a launch file chose is text, never markup
tables.py   the tables, readable without JavaScript and on paper
assets/     style sheet, script and the graph library
"""
