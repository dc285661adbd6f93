"""Packages of others that launch files import, for machines on which they are not installed.

``description/install.py`` names them; an installed package is used in the place of its stand-in.
"""
