"""Starts what evaluation decided and keeps it running: processes, their output, events, the end."""
