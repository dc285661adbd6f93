"""The verb of ``secure-nodl`` that infers interfaces from sources."""
