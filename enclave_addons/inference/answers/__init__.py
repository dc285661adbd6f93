"""Answers of earlier runs, by what they were made from: our own code, build files, the content of each source.

``python`` and ``cpp`` say what an answer depends on, ``codec`` writes answers as JSON, and ``folder`` stores them where
only this user may write.
"""
