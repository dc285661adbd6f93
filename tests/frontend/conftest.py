"""A busy machine is no failure: property tests here have no deadline for a single example."""

from hypothesis import settings

settings.register_profile("frontend", deadline=None)
settings.load_profile("frontend")
