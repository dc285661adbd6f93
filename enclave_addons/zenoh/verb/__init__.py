"""The verbs of ``secure-keystore`` for Zenoh."""
