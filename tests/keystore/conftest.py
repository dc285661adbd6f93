"""Property tests count examples, not milliseconds: a loaded machine must not fail them."""

from hypothesis import settings

settings.register_profile("keystore", deadline=None)
settings.load_profile("keystore")
