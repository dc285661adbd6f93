"""The outside world as evaluation sees it: packages, commands, files, processes, the environment, time.

``protocol`` says what may be asked, ``plan_host`` answers for the dry run (records, starts and writes nothing),
``runtime.live_host`` for real; ``current`` holds the one in charge.
"""
