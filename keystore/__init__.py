"""SROS2 keystores: certificates, governance, permissions, and the policy they follow.

    verb/           the commands of secure-keystore
    steps/          create, provision, renew, roll over, remove, export
    verification/   what a reviewer would find
    disk/           which file lies where, safe reading, and store.py: the only writer
    signing/        CAs and their keys; certificates and signed documents
    formats/        names, policy, permissions, governance, certificates as values. Pure

Each room imports those below it, none above.
The public functions below are loaded when first used, so that a launch imports only what its path needs:
``provision`` of a keystore in which nothing changed imports neither ``cryptography`` nor lxml. The verbs of
``secure-keystore`` call the same functions.
"""

from __future__ import annotations

from enclave_launch.boundary.public_names import public_names

__getattr__, __dir__ = public_names(__name__, __file__)
