"""The installed command of the review add-on."""

from __future__ import annotations

from enclave_common.entry import run


def secure_plan() -> int:
    """Run ``secure-plan``."""
    return run("secure-plan", "enclave_addons.review.verb")
