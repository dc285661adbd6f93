"""The outside world as evaluation sees it: packages, commands, files, processes, the environment, time."""
