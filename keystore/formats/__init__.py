"""Content of a keystore's files: names, policy, permissions, governance, certificates as values. Performs no I/O."""
