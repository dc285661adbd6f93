"""What the files of a keystore say: names, policy, permissions, governance, certificates as values. Performs no I/O."""
