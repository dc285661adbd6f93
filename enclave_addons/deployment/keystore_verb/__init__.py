"""The verbs of ``secure-keystore`` for other hosts: bundles, keys made there, units."""
