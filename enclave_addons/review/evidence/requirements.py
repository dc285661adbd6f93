"""The requirements that each part of the evidence supports.

Regulation (EU) 2024/2847 (Cyber Resilience Act), Annex I; IEC 62443-3-3:2013 (SR) and 62443-4-2:2019 (CR), whose
numbers agree where both are named; ISO 10218-1:2025 and -2:2025, which ask that threats to safety from unauthorised
access be dealt with, named here as a whole.
"""

from __future__ import annotations

from typing import NamedTuple


class EvidencePart(NamedTuple):
    """One part of the evidence: ``files`` of the evidence, what they show, and the requirements that this supports."""

    name: str
    files: tuple[str, ...]
    shows: str
    supports: tuple[str, ...]


DISCLAIMER = (
    "This evidence claims no conformity with any law or standard. It shows what was planned and checked for one "
    "launch; each part names the requirements that it can support in an assessment of the whole product."
)
_ISO = "ISO 10218-1:2025 and ISO 10218-2:2025, cybersecurity"
PARTS = (
    EvidencePart(
        "Access control",
        ("access-control.csv", "access-control.json", "plan.json"),
        "each permission of each enclave, the nodes that request it, and where that is written",
        (
            "CRA Annex I part I (2)(d): protection from unauthorised access",
            "IEC 62443-3-3 SR 2.1, 62443-4-2 CR 2.1: authorization enforcement",
            "IEC 62443-3-3 SR 7.7, 62443-4-2 CR 7.7: least functionality",
            _ISO,
        ),
    ),
    EvidencePart(
        "Attack surface",
        ("attack-surface.json", "report.html"),
        "what each enclave accepts from others, what only a party outside of the launch could send, programs without "
        "an enclave, wildcards, and which enclave can influence which",
        (
            "CRA Annex I part I (2)(j): limited attack surfaces, including external interfaces",
            "IEC 62443-3-3 SR 5.1, 62443-4-2 CR 5.1: network segmentation",
            _ISO,
        ),
    ),
    EvidencePart(
        "Keys and algorithms",
        ("keys.json",),
        "every certificate of the keystore with its algorithm, its expiry and where its private key is",
        (
            "CRA Annex I part I (2)(e): confidentiality by state of the art mechanisms",
            "IEC 62443-3-3 SR 1.8, 62443-4-2 CR 1.8: public key infrastructure certificates",
            "IEC 62443-3-3 SR 1.9, 62443-4-2 CR 1.9: strength of public key authentication",
            "IEC 62443-3-3 SR 4.3, 62443-4-2 CR 4.3: use of cryptography",
        ),
    ),
    EvidencePart(
        "Secure defaults",
        ("secure-defaults.json",),
        "the governance in force, attribute by attribute, each that is weaker than the default, and what "
        "secure-keystore verify found",
        (
            "CRA Annex I part I (2)(b): secure by default configuration",
            "CRA Annex I part I (2)(e) and (f): confidentiality and integrity of what is transmitted",
            "IEC 62443-3-3 SR 1.2, 62443-4-2 CR 1.2: software process and device identification and authentication",
            "IEC 62443-3-3 SR 3.1, 62443-4-2 CR 3.1: communication integrity",
            "IEC 62443-3-3 SR 4.1, 62443-4-2 CR 4.1: information confidentiality",
            "IEC 62443-3-3 SR 7.6, 62443-4-2 CR 7.6: network and security configuration settings",
        ),
    ),
    EvidencePart(
        "Findings and accepted exceptions",
        ("findings.json", "findings.sarif", "accepted.json"),
        "what the checks found, and which findings somebody accepted, with the reason",
        (
            "CRA Annex I part II (3): regular tests and reviews",
            "CRA Article 13 (2) and (3): cybersecurity risk assessment",
        ),
    ),
    EvidencePart(
        "Components",
        ("components.json",),
        "the software bill of materials that belongs to the product, by its CycloneDX BOM-Link and hash",
        (
            "CRA Annex I part II (1): components documented in a software bill of materials",
            "IEC 62443-3-3 SR 7.8, 62443-4-2 CR 7.8: control system component inventory",
        ),
    ),
    EvidencePart(
        "Scope",
        ("scope.json",),
        "what was checked, by which checks, and what was not: gaps of the plan, parts that were not given",
        ("CRA Article 31 and Annex VII: technical documentation",),
    ),
)
