"""Fuzz targets: each parser of foreign text with what it may raise, fed with damaged and invented input.

targets.py        the parsers, each with documents to start from and the words of its language
inputs.py         a document -> one that somebody damaged
test_parsers.py   a bounded number of inputs for each, in every test run
__main__.py       ./dev fuzz [TARGET [MINUTES]]: as long as you like
"""
