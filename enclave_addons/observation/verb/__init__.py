"""The verbs of ``secure-nodl`` and ``secure-plan`` that observe a DDS domain."""
