"""The parsers of our programs. A target runs one on bytes; what else than ``refusals`` it raises is a fault."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yaml

from enclave_addons.deployment import request
from enclave_addons.deployment.bundle_file import bundle_bytes, sealed_bundle
from enclave_addons.deployment.host_keys import parse_requests, requests_text
from enclave_addons.deployment.hosts import parse_hosts
from enclave_addons.observation.graph.discovery_info import decode as decode_discovery_info
from enclave_addons.observation.graph.json_form import NotAGraph, graph_document
from enclave_addons.observation.graph.json_form import graph_from_document as observed_from
from enclave_addons.recording.record.lines import read_lines
from enclave_common.shell_words import split_words
from enclave_common.xml_tree import RefusedXml
from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.markup.xml import parse_launch_xml as parse_launch_xml
from enclave_launch.frontend.substitution_grammar import TemplateSyntaxError, parse_template
from enclave_launch.ros_rules.parameter_file import RefusedParameters, sections_of_text
from keystore import Domains, KeystoreError
from keystore.formats.bundle import parse_manifest
from keystore.formats.certificate import read_certificates
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.governance import parse_governance, read_foreign_governance
from keystore.formats.governance_yaml import parse_governance_yaml
from keystore.formats.permissions_document import parse_permissions, read_foreign_permissions
from keystore.formats.policy_xml import parse_policy
from keystore.formats.register import parse_register
from keystore.formats.shares import parse_shares
from keystore.formats.validity import parse_duration, parse_time
from keystore.signing import smime
from keystore.verification.files import holds_private_key
from nodl.document.v1 import parse_v1
from nodl.document.v2 import parse_v2
from nodl.errors import InvalidNoDLError
from nodl.remap import InvalidRemapRuleError, parse_rule
from nodl.ros_arguments import parse_ros_arguments
from tests.addons.observation.graph.made import one_node
from tests.addons.observation.graph.test_discovery_info import encoded

FIXTURES = Path(__file__).parents[2] / "fixtures/demo_ws/share/demo_nodes"
GOLDEN = Path(__file__).parents[1] / "keystore/golden_permissions"


HOSTS = b"""version: 1
hosts:
  base: {enclaves: [/base, "/base/*"], nodes: ["/camera/*"]}
needs:
  - {nodes: ["/camera/*"], devices: [/dev/video0], realtime: true, memory: 1Gi}
"""
MANIFEST = b"""{
"type": "enclave-launch bundle", "version": 1, "host": "base", "number": 1763774400,
"authorities": {"identity_ca": ["ab"], "permissions_ca": ["cd"]}, "crl_number": 0, "ends": "2036-11-19T02:06:24Z",
"enclaves": [["/base", "1f", "ab", "cd", "2026-11-19T02:06:24Z", "2036-11-19T02:06:24Z", true]],
"files": [["public/identity_ca.cert.pem", "ab"]]
}
"""


class Target(NamedTuple):
    """``seeds``: valid documents; ``words``: what its language is made of."""

    run: Callable[[bytes], object]
    refusals: tuple[type[Exception], ...]
    seeds: tuple[bytes, ...]
    words: tuple[bytes, ...]


def text(parse: Callable[[str], object]) -> Callable[[bytes], object]:
    """A parser of text sees what could be decoded."""
    return lambda data: parse(data.decode("utf-8", "replace"))


def read(*names: str) -> tuple[bytes, ...]:
    return tuple((FIXTURES / name).read_bytes() for name in names)


def template(data: str) -> None:
    parse_template(data)


def words(*listed: str) -> tuple[bytes, ...]:
    return tuple(word.encode() for word in listed)


def observed_document() -> dict[str, object]:
    return graph_document(one_node("/a/b", "writer rt/x a::msg::dds_::B_"))


XML = words(
    "<!DOCTYPE a [<!ENTITY a 'x'>]>",
    "&a;",
    "&#0;",
    "&#x1b;",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?xml?>",
    "<a>",
    "</a>",
    "xmlns:x=''",
    "/>",
)
YAML = words(
    "&a ",
    "*a",
    "<<: ",
    "- ",
    "? ",
    ": ",
    "[",
    "{",
    "]",
    "}",
    "!!python/object:os.system ",
    "|\n",
    ">\n",
    "---\n",
    "1e3",
    "0x",
    "~",
    "2024-01-01",
)
ROS = words(
    "/",
    "~",
    "__",
    ":=",
    "rostopic://",
    "__node",
    "__ns",
    "--ros-args",
    "-r",
    "-p",
    "--",
    "--enclave",
    "{node}",
    "*",
    "**",
)

LAUNCH_YAML = read("launch/talker_listener.launch.yaml")
POLICY = tuple(path.read_bytes() for path in sorted(GOLDEN.glob("*.policy.xml")))
NODL_V2 = (
    b"nodl_version: 2\nservice_clients:\n- name: a\n  type: p/srv/B\nparameters:\n  rate: {type: double}\n"
)
GOVERNANCE_YAML = (
    b"version: 1\ndomain_rules:\n- domains: 0-10,42\n  topic_rules:\n  - topic_expression: rt/camera/*\n"
)
_DOCUMENTS: dict[str, bytes] = {}


def documents() -> dict[str, bytes]:
    """A small keystore's files, made once: documents as they are signed."""
    if not _DOCUMENTS:
        from tests.keystore.kit import filled

        with tempfile.TemporaryDirectory() as folder:
            root = filled(Path(folder) / "ks", ["/a"])
            for name in ("enclaves/a/permissions.p7s", "enclaves/a/permissions.xml", "enclaves/a/cert.pem",
                         "enclaves/a/key.pem", "enclaves/governance.xml", "private/register.json"):  # fmt: skip
                _DOCUMENTS[name.rpartition("/")[2]] = (root / name).read_bytes()
            _DOCUMENTS["requests.pem"] = requests_text(request(Path(folder) / "host", ["/a"]))
    return _DOCUMENTS


@cache
def targets() -> dict[str, Target]:
    made = documents()
    refused = (KeystoreError,)
    return {
        "launch-xml": Target(
            text(parse_launch_xml),
            (SyntaxError, RefusedXml),
            read("launch/talker_listener.launch.xml", "launch/services_actions.launch.xml"),
            XML,
        ),
        "launch-yaml": Target(text(load_yaml), (yaml.YAMLError, ValueError), LAUNCH_YAML, YAML),
        "value": Target(
            text(load_yaml),
            (yaml.YAMLError, ValueError, RecursionError),
            (b"[1, 2]", b"1.5", b"{a: b}", b"yes"),
            YAML,
        ),
        "parameter-file": Target(
            text(sections_of_text),
            (yaml.YAMLError, RefusedParameters),
            (b"/**:\n  ros__parameters:\n    a: 1\n",),
            YAML,
        ),
        "substitution": Target(
            text(template),
            (TemplateSyntaxError, ValueError),
            (b"$(find-pkg-share a)/x", b"a $(var 'b c') d", b"$(eval \"'$(var x)' == 'y'\")"),
            words("$(", ")", "$(var ", "\\", "'", '"', " ", "$"),
        ),
        "command-line": Target(
            text(split_words), (ValueError,), (b'a \'b c\' "d\\"e" f\\ g',), words("'", '"', "\\", " ")
        ),
        "ros-arguments": Target(
            text(lambda line: parse_ros_arguments(line.split("\0"))),
            (),
            (b"--ros-args\0-r\0a:=b\0-p\0x:=1\0--\0c",),
            (*ROS, b"\0"),
        ),
        "remap-rule": Target(
            text(parse_rule), (InvalidRemapRuleError,), (b"a:=b", b"talker:chatter:=/x", b"__ns:=/a"), ROS
        ),
        "nodl-v1": Target(
            lambda data: parse_v1(data, "a.nodl.xml"),
            (InvalidNoDLError,),
            read("demo_nodes.nodl.xml", "components.nodl.xml"),
            XML,
        ),
        "nodl-v2": Target(
            lambda data: parse_v2(data, "/nowhere/a.nodl.yaml", package="p", name="a"),
            (InvalidNoDLError,),
            (NODL_V2,),
            YAML,
        ),
        "recording": Target(
            read_lines,
            (),
            (b'{"kind": "run"}\n', b'[1]\n{"a": "b"}\n'),
            words("{", "}", '"kind":', "[", "]", ",", "null"),
        ),
        "policy": Target(parse_policy, refused, POLICY, XML),
        "governance-yaml": Target(
            lambda data: parse_governance_yaml(data, "a.yaml"), refused, (GOVERNANCE_YAML,), YAML
        ),
        "hosts": Target(lambda data: parse_hosts(data, "a.yaml"), refused, (HOSTS,), YAML),
        "bundle": Target(
            lambda data: sealed_bundle(data, "a.bundle").opened(parse_manifest(MANIFEST, "a")),
            refused,
            (bundle_bytes(MANIFEST, {"public/identity_ca.cert.pem": b"ab"}),),
            words("\n", "0\n", "1\n", "9", "-1\n", "enclave-launch bundle 1\n"),
        ),
        "bundle-manifest": Target(
            lambda data: parse_manifest(data, "a"),
            refused,
            (MANIFEST,),
            words('"', "[", "]", "{", "}", ",", "null"),
        ),
        "certificate-requests": Target(
            lambda data: parse_requests(data, "a.pem"),
            refused,
            (made["requests.pem"],),
            words(
                "enclave: ", "\n", "-----BEGIN CERTIFICATE REQUEST-----", "-----END CERTIFICATE REQUEST-----"
            ),
        ),
        "governance": Target(
            lambda data: parse_governance(data, "a.xml"), refused, (made["governance.xml"],), XML
        ),
        "permissions": Target(
            lambda data: parse_permissions(data, "a.xml"), refused, (made["permissions.xml"],), XML
        ),
        "foreign-governance": Target(
            lambda data: read_foreign_governance(data, "a.xml"), refused, (made["governance.xml"],), XML
        ),
        "foreign-permissions": Target(
            lambda data: read_foreign_permissions(data, "/a", "a.xml"),
            refused,
            (made["permissions.xml"],),
            XML,
        ),
        "signed-document": Target(
            lambda data: smime.read_any(data, "a.p7s").embeds(b""),
            refused,
            (made["permissions.p7s"],),
            words("------", "\r\n", "Content-Type: text/plain", "base64", "boundary="),
        ),
        "certificate": Target(
            lambda data: read_certificates(data, "a.pem"),
            refused,
            (made["cert.pem"], made["cert.pem"] * 2),
            words("-----BEGIN CERTIFICATE-----", "-----END CERTIFICATE-----"),
        ),
        "pkcs7": Target(
            lambda data: smime.SignedDocument(b"", data).embeds(b""),
            (),
            (smime.read(made["permissions.p7s"], "a.p7s").pkcs7, b"\x30\x03\x02\x01\x01"),
            (b"\x30\x80", b"\x30\x84\xff\xff\xff\xff", b"\x02\x01\x00"),
        ),
        "key-search": Target(
            holds_private_key, (), (made["key.pem"], made["cert.pem"]), words("-----BEGIN ", "PRIVATE KEY")
        ),
        "register": Target(
            lambda data: parse_register(data, "register.json"),
            refused,
            (made["register.json"], json.dumps({"version": 1}).encode()),
            words("[", "]", "{", "}", "null", "true", '"', "1e999", ","),
        ),
        "shares": Target(
            lambda data: parse_shares(data, "shares.json"),
            refused,
            (b"{}", b'{"version": 1, "shares": []}'),
            words("[", "]", "{", "}", "null", "true", '"', "1e999", ","),
        ),
        "discovery-info": Target(
            decode_discovery_info,
            (),
            (encoded(bytes(16), [("/a/b", [bytes(16)], [])], 16), encoded(bytes(16), [], 24)),
            (b"\0\1\0\0", bytes(8), b"\xff\xff\xff\xff"),
        ),
        "observed-graph": Target(
            lambda data: observed_from(json.loads(data)),
            (NotAGraph, ValueError),
            (json.dumps(observed_document()).encode(),),
            words("[", "]", "{", "}", "null", "true", '"', "1e999", ","),
        ),
        "domains": Target(text(Domains.parse), refused, (b"0-10,42", b"all"), words("-", ",", "9")),
        "enclave-name": Target(
            text(validate_enclave_name), refused, (b"/a/b",), words("/", "..", "//", "\n")
        ),
        "duration": Target(text(parse_duration), refused, (b"10d", b"2y"), words("9", "y")),
        "date": Target(
            text(parse_time), refused, (b"2031-05-01T12:00:00Z",), words("-", ":", "+14:00", "9999")
        ),
    }
