"""Starts what evaluation decided and keeps it running: processes, their output, events, the end.

live_launch       the event loop that drives all of the below (overlap: what is the whole program's)
running_launch    a launch beside the program that started it; run_events: what it observes
live_host         the evaluation's seam to the world, live
gate              its enclave, complete before a process starts; difference: what came instead of the planned, in words
environment_watch whether what runs has the environment that was planned
live_process      one process action; supervision: its life, respawn, escalation
process_tree      spawn, signal, exit
warden            the small process that forks, and that leaves no orphan whatever happens to us
                  (warden_process, warden_channel: our ends of it; survivors: what is left when it is killed)
routing, sinks    output to screen and log files; back_pressure: who waits; launch_log: launch's own, and where all are
companion         who goes along with a launch: recorders, watches
ros_services      calls of the launcher's own node
"""
