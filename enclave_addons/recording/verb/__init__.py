"""The verb of ``secure-nodl`` that compares records with other descriptions."""
