"""The same grants under a new subject or validity: what ``renew`` signs. Pure.

Needed where no policy is at hand: the permissions an enclave has are the only record of what it may do.
"""

from __future__ import annotations

from collections.abc import Collection

from lxml import etree

from keystore.errors import DamagedKeystoreError
from keystore.formats.permissions_read import check_permissions_schema
from keystore.formats.validity import Validity

_DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'


def redated(
    document: bytes, old_subjects: Collection[str], subject: str, validity: Validity, place: str
) -> bytes:
    """``document`` with the grant of one of ``old_subjects`` given to ``subject`` for ``validity``.

    Only the first such grant stays: of several for one subject the implementations use only that one, and
    foreign grants have no place in a document every peer gets to see. Raises InvalidInputError for what is no
    permissions document and DamagedKeystoreError when no grant fits.
    """
    root = check_permissions_schema(document, place)
    grants = list(root.iter("grant"))
    mine = next((grant for grant in grants if _subject(grant) in old_subjects), None)
    if mine is None:
        raise DamagedKeystoreError(f"{place} has no grant for {subject}")
    for grant in grants:
        parent = grant.getparent()
        if grant is not mine and parent is not None:
            parent.remove(grant)
    _set(mine, "subject_name", subject)
    _set(mine, "validity/not_before", f"{validity.not_before:%Y-%m-%dT%H:%M:%S}")
    _set(mine, "validity/not_after", f"{validity.not_after:%Y-%m-%dT%H:%M:%S}")
    return (_DECLARATION + etree.tostring(root, encoding="unicode") + "\n").encode()


def _subject(grant: etree._Element) -> str:
    return (grant.findtext("subject_name") or "").strip()


def _set(grant: etree._Element, path: str, text: str) -> None:
    element = grant.find(path)
    if element is not None:
        element.text = text
