"""Documents made at random, and what Cyclone DDS, Fast DDS and we make of them: a judge for ``verify``.

A document is written by our writer and then, in most cases, changed by bytes as no XML tool would. Whatever ``verify``
calls good must grant the same to both implementations and to us: each is asked with endpoints of probe names.
"""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from enclave_addons.deployment import export
from keystore import (
    CaAccess,
    DomainRule,
    Domains,
    Governance,
    KeystoreError,
    Role,
    Severity,
    TopicRule,
    verify,
)
from keystore.disk.view import KeystoreView
from keystore.formats.governance import governance_document
from keystore.formats.permissions import Permissions, TopicSets, dds_rules
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.permissions_patterns import any_matches
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule
from keystore.signing.authority import Authority
from keystore.signing.smime import sign_document
from tests.dds import our_keystore
from tests.dds.probe import Answers, Participant, Probe

PROBES = ("rt/a", "rt/a/b", "rt/ab/c", "rq/aRequest", "rr/a/bReply", "rt/cmd_vel", "X")
NAMES = (
    "/a",
    "/a/b",
    "/ab/c",
    "/*",
    "/a*",
    "/?",
    "/[ab]",
    "/[!a]/b",
    "/a/[a-c]",
    "/[0-9A-z]*",
    "/*b",
    "/cmd_vel",
)
WORDS = (
    b"<!-- x -->", b"<!--", b"-->", b"<![CDATA[", b"]]>", b"&#97;", b"&#x61;", b"&amp;", b"&lt;", b"<?x?>",
    b" ", b"\t", b"\n", b"\r\n", b"\r", b"\0", b"\xe9", b"\xef\xbb\xbf",
    b"0", b"07", b"+", b"-", b"0x", b".0", b"1", b"rt/", b"a", b"/",
    b"*", b"?", b"[!a]", b"[^a]", b"[[:alpha:]]", b"[z-a]", b"[a-]", b"{a,b}", b"\\", b"<topic>*</topic>", b"<topic/>",
    b"<default>ALLOW</default>", b"DENY", b"ALLOW", b"allow", b"deny", b"true", b"false", b"TRUE", b"NONE", b"ENCRYPT",
    b"UTF-7", b"+ACo-", b"UTF-16", b"ISO-8859-1", b"xmlns='a'", b"<!DOCTYPE dds>", b"<id>0</id>",
    b"</allow_rule><allow_rule>", b"<partitions><partition>p</partition></partitions>",
)  # fmt: skip
BATCH = 10
"""Documents that an implementation is asked about at once, each in a process of its own."""


@dataclass
class Verdicts:
    """How many documents were made, which of them ``verify`` called good, and where somebody else differs."""

    made: int = 0
    good: int = 0
    changed_and_good: int = 0
    differences: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Candidate:
    """A document that ``verify`` called good, in an enclave directory of its own."""

    label: str
    directory: Path
    permissions: Permissions
    document: bytes


class Laboratory:
    """An enclave as it is deployed, whose documents are replaced by others that its own permissions CA signed."""

    def __init__(self, folder: Path, domain: int) -> None:
        root = folder / "ks"
        our_keystore.provision(root, domain, [EnclavePolicy("/e", ())])
        export(root, folder / "deployed", ["/e"])
        self._folder, self._domain, self._deployed = folder, domain, folder / "deployed"
        self._ca: Authority = KeystoreView(root).authority(Role.PERMISSIONS, CaAccess())
        own = (root / "enclaves/e/permissions.xml").read_bytes()
        self._own = parse_permissions(own)
        self._governance = (root / "enclaves/governance.xml").read_bytes()

    def judge(self, seed: int, count: int, probes: Sequence[Probe]) -> Verdicts:
        """Make ``count`` documents from ``seed``, and ask of those that are good."""
        source, verdicts = random.Random(seed), Verdicts()
        candidates: list[Candidate] = []
        for number in range(count):
            candidates += self._candidate(source, f"{seed}-{number}", verdicts)
            if len(candidates) >= BATCH or number == count - 1:
                for probe in probes:
                    verdicts.differences += self._differences(probe, candidates)
                for one in candidates:
                    shutil.rmtree(one.directory.parents[1])
                candidates = []
        return verdicts

    def _candidate(self, source: random.Random, label: str, verdicts: Verdicts) -> Iterator[Candidate]:
        root = self._folder / label
        permissions = self._own._replace(rules=dds_rules(EnclavePolicy("/e", (_profile(source),))))
        document, governance = permissions.document(), self._governance
        written = document
        kind = source.randrange(5)
        if kind == 0:
            governance = _changed(source, _governance(source, self._domain))
        elif kind > 1:
            document = _changed(source, document)
        verdicts.made += 1
        shutil.copytree(self._deployed, root, symlinks=True)
        try:
            (root / "enclaves/governance.p7s").write_bytes(_signed(governance, self._ca))
            (root / "enclaves/e/permissions.p7s").write_bytes(_signed(document, self._ca))
            serious = (Severity.ERROR, Severity.EXPOSURE)
            codes = {one.code for one in verify(root).findings if one.severity in serious}
            is_good = not codes - {"everything", "governance-weak"}
        except KeystoreError:  # a document that cannot even be signed
            is_good = False
        if not is_good:
            shutil.rmtree(root)
            return
        verdicts.good += 1
        verdicts.changed_and_good += document != written
        yield Candidate(label, root / "enclaves/e", parse_permissions(document), document + governance)

    def _differences(self, probe: Probe, candidates: list[Candidate]) -> Iterator[str]:
        participants = [
            Participant(one.label, one.directory, publish=PROBES, subscribe=PROBES) for one in candidates
        ]
        answers = probe.try_endpoints(self._domain, participants)
        for one in candidates:
            theirs, ours = _granted(answers, one.label), _ours(one.permissions, probe)
            if not answers.participants.get(one.label) or theirs != ours:
                yield f"{probe.name} {one.label}: differs on {sorted(theirs ^ ours)}\n{one.document.decode()}"


def _granted(answers: Answers, label: str) -> set[tuple[str, str]]:
    return {
        (verb, topic) for verb in TopicSets._fields for topic in PROBES if answers.may(label, verb, topic)
    }


def _ours(permissions: Permissions, probe: Probe) -> set[tuple[str, str]]:
    """Cyclone DDS before 11.0 asks of a topic first, and there a rule for either direction decides."""
    rules = permissions.rules
    return {
        (verb, topic)
        for verb in TopicSets._fields
        for topic in PROBES
        if rules.permits(verb, topic) and (probe.name != "Cyclone DDS" or _may_be_made(permissions, topic))
    }


def _may_be_made(permissions: Permissions, topic: str) -> bool:
    rules = permissions.rules
    for part, verdict in ((rules.first, True), (rules.deny, False), (rules.allow, True)):
        if any_matches((*part.publish, *part.subscribe), topic):
            return verdict
    return False


def _profile(source: random.Random) -> Profile:
    rules = tuple(
        Rule(
            source.choice(tuple(Operation)),
            source.choice((Qualifier.ALLOW, Qualifier.ALLOW, Qualifier.DENY)),
            source.choice(NAMES),
        )
        for _ in range(source.randrange(6))
    )
    return Profile("/", "n", rules)


def _governance(source: random.Random, domain: int) -> bytes:
    topics = tuple(TopicRule(f"rt{source.choice(NAMES)}") for _ in range(source.randrange(3)))
    return governance_document(Governance((DomainRule(domains=Domains.single(domain), topic_rules=topics),)))


def _changed(source: random.Random, document: bytes) -> bytes:
    """Change a few bytes: of a name or a number, or anything anywhere."""
    for _ in range(source.choice((1, 1, 1, 2, 4))):
        document = _once(source, document)
    return document


def _once(source: random.Random, document: bytes) -> bytes:
    lines = document.splitlines(keepends=True)
    at = source.randrange(len(lines))
    way = source.randrange(6)
    if way == 0:
        lines.insert(source.randrange(len(lines)), lines[at])
    elif way == 1:
        del lines[at]
    elif way == 2:
        other = source.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    else:
        topics = [number for number, line in enumerate(lines) if line.startswith(b"<topic")]
        at = source.choice(topics or [at]) if way > 3 else at
        position = source.randrange(len(lines[at]))
        word = source.choice(WORDS) if way < 5 else bytes([source.choice(b"abcnrstvxyz_/*?AZ09")])
        lines[at] = lines[at][:position] + word + lines[at][position + (way == 5) :]
    return b"".join(lines)


def _signed(document: bytes, ca: Authority) -> bytes:
    return sign_document(document, ca)
