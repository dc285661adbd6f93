"""From launch files to processes: visiting a description, the argument scan, events.

    frontend text / Python file -> description objects -> **evaluation** -> process.Evaluation

``events`` holds the queue and handler rules that the dry run and the live runtime share.
"""
