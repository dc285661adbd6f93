"""The verb of ``secure-nodl`` that lists and checks the library."""
