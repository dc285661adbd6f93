"""Validity of node names and namespaces, with the exceptions that launch files know from rclpy."""

from __future__ import annotations

from nodl import names


class NameValidationException(ValueError):
    """A name that rmw would refuse: the reason, the name, and where in it."""

    def __init__(self, error: names.InvalidNameError, what: str):
        position = error.position or 0
        super().__init__(f"Invalid {what}: {error.reason}:\n  '{error.name}'\n   {' ' * position}^")


class InvalidNodeNameException(NameValidationException):
    pass


class InvalidNamespaceException(NameValidationException):
    pass


def validate_node_name(name: str) -> None:
    """Raises ``InvalidNodeNameException``."""
    try:
        names.validate_node_name(name)
    except names.InvalidNameError as error:
        raise InvalidNodeNameException(error, "node name") from None


def validate_namespace(namespace: str) -> None:
    """Raises ``InvalidNamespaceException``."""
    try:
        names.validate_namespace(namespace)
    except names.InvalidNameError as error:
        raise InvalidNamespaceException(error, "namespace") from None
