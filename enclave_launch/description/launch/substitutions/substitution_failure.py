"""The error of a substitution that cannot be performed."""


class SubstitutionFailure(RuntimeError):
    """The message says why."""
