"""Which file lies where in a keystore, how it is read safely, and the one module that writes: ``store``."""
