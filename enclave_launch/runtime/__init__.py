"""Starts what evaluation decided and keeps it running: processes, their output, events, the end.

warden            the small process that forks, and that leaves no orphan whatever happens to us
process_tree      our side of it: spawn, signal, exit
supervision       one process over its life: respawn, escalation
routing, sinks    its output to screen and log files; launch_log: launch's own, and where all of them are
gate              its enclave, complete before it starts
live_host         the evaluation's seam to the world, live
live_launch       the event loop that drives evaluation and all of the above
"""
