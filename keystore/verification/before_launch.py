"""The cheap part of ``verify``, before each secured launch: what works and exposes the keystore all the same.

No XML parser is imported while the governance is the default one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

from keystore.disk import layout
from keystore.disk.signed_documents import governance_domains, signed_governance
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError
from keystore.formats.governance import Governance, governance_document, parse_governance
from keystore.formats.role import Role
from keystore.verification.files import check_parents
from keystore.verification.governance import weaknesses


def exposures(view: KeystoreView) -> Iterator[str]:
    """Return one text for each exposure; none for a keystore that is not complete yet."""
    if not view.is_complete:
        return
    if view.shares_one_ca:
        yield (
            "this keystore has one CA for identities and permissions (CVE-2023-24010, CVE-2023-24011); "
            "secure-keystore renew separates them"
        )
    files = [name for role in Role if (name := view.key_file(role)) is not None]
    if any(os.stat(view.root / name).st_mode & 0o077 for name in files):
        yield (
            "the CA keys can be read by others; secure-keystore renew closes them. Whoever read them can make any "
            "enclave: secure-keystore renew --ca start replaces them"
        )
    for finding in check_parents(view.root):
        if finding.severity.fails:
            yield f"{finding.place} {finding.message}; {finding.repair}"
    for weakness in _weak_governance(view):
        yield f"the governance is weaker than the default: {weakness}"


def _weak_governance(view: KeystoreView) -> Iterator[str]:
    try:
        document = signed_governance(view).document
        if document == governance_document(Governance.for_domains(governance_domains(view))):
            return
        yield from weaknesses(parse_governance(document, layout.GOVERNANCE))
    except KeystoreError:
        return  # a governance that cannot be read is repaired or refused by the comparison
