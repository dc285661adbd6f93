"""Records the calls of processes to librcl while they run. Learning, audit and explanations use the same recorder."""
