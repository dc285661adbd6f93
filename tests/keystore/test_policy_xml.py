"""SROS2 policies in and out (ros2/design ros2_access_control_policies, version 0.2.0)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from keystore import (
    EnclavePolicy,
    InvalidInputError,
    Operation,
    Policy,
    Profile,
    Qualifier,
    Rule,
    read_policy,
)
from keystore.formats.policy import PolicyError
from keystore.formats.policy_xml import parse_policy, policy_xml
from keystore.formats.safe_xml import parse_foreign

GROUP = '<topics publish="ALLOW"><topic>chatter</topic></topics>'


def policy(
    body: str = GROUP, *, path: str = "/talker", profile: str = 'ns="/" node="talker"', head: str = ""
) -> str:
    return (
        f'{head}<policy version="0.2.0"><enclaves><enclave path="{path}"><profiles>'
        f"<profile {profile}>{body}</profile></profiles></enclave></enclaves></policy>"
    )


def read(text: str) -> Policy:
    return parse_policy(text.encode()).policy


def test_every_kind_of_rule() -> None:
    (enclave,) = read(
        policy(
            '<topics publish="ALLOW" subscribe="DENY"><topic>a</topic><topic>~/b</topic></topics>'
            '<services reply="ALLOW" request="ALLOW"><service>/s</service></services>'
            '<actions call="DENY" execute="ALLOW"><action>f</action></actions>'
        )
    ).enclaves
    (profile,) = enclave.profiles
    assert {(r.operation.value, r.qualifier.value, r.expression) for r in profile.rules} == {
        *(("publish", "ALLOW", "a"), ("publish", "ALLOW", "~/b"), ("subscribe", "DENY", "a")),
        *(("subscribe", "DENY", "~/b"), ("reply", "ALLOW", "/s"), ("request", "ALLOW", "/s")),
        *(("call", "DENY", "f"), ("execute", "ALLOW", "f")),
    }


def test_comments_and_instructions_are_ignored_everywhere() -> None:
    noise = "<!-- c --><?pi x?>"
    text = policy(GROUP).replace("><", f">{noise}<").replace("chatter", f"chat{noise}ter")
    assert read(text) == read(policy(GROUP))


def test_profiles_and_enclaves_that_occur_twice_are_merged() -> None:
    other = GROUP.replace("chatter", "other")
    one = policy(GROUP).split("<enclaves>")[1].split("</enclaves>")[0]
    text = f'<policy version="0.2.0"><enclaves>{one}{one.replace(GROUP, other)}</enclaves></policy>'
    document = parse_policy(text.encode())
    (enclave,) = document.policy.enclaves
    (profile,) = enclave.profiles
    assert [rule.expression for rule in profile.rules] == ["chatter", "other"]
    assert "enclave /talker is defined again" in document.warnings[0]


def test_a_group_without_qualifier_is_warned_of() -> None:
    document = parse_policy(policy("<topics>\n<topic>a</topic></topics>").encode(), "p.xml")
    assert document.warnings == ("p.xml:1: <topics> without publish or subscribe has no effect",)


def test_wildcards_and_denials_are_reported() -> None:
    text = policy('<topics publish="DENY" subscribe="ALLOW"><topic>/x</topic><topic>cam*</topic></topics>')
    notes = parse_policy(text.encode(), "p.xml").notes
    assert [note.partition("enclave /talker: ")[2] for note in notes] == [
        "denial DENY publish /x",
        "wildcard DENY publish cam*",
        "wildcard ALLOW subscribe cam*",
    ]


def test_every_rule_knows_its_line() -> None:
    text = policy('\n\n<topics publish="ALLOW">\n<topic>a</topic>\n</topics>')
    document = parse_policy(text.encode(), "p.xml")
    assert list(document.places.values()) == ["p.xml:4"]


NOT_POLICIES = {
    "not well-formed": ("<policy>", "not well-formed"),
    "another root": ('<nodes version="0.2.0"/>', "expected <policy>"),
    "no version": ("<policy><enclaves/></policy>", "needs the attribute version"),
    "unknown version": ('<policy version="0.3.0"><enclaves/></policy>', "'0.3.0' is not supported"),
    "no enclaves": ('<policy version="0.2.0"/>', "expected <enclaves>"),
    "two enclaves elements": ('<policy version="0.2.0"><enclaves/><enclaves/></policy>', "exactly one"),
    "enclaves empty": ('<policy version="0.2.0"><enclaves/></policy>', "at least one <enclave>"),
    "no profile": (policy().replace('<profile ns="/" node="talker">', "<x>"), "not well-formed"),
    "unknown element": (policy("<topix/>"), "<topix> is not allowed"),
    "unknown attribute": (policy('<topics public="ALLOW"><topic>a</topic></topics>'), "no attribute public"),
    "qualifier in lower case": (policy('<topics publish="allow"><topic>a</topic></topics>'), "ALLOW or DENY"),
    "group without entries": (policy('<topics publish="ALLOW"/>'), "at least one <topic>"),
    "wrong entry": (policy('<topics publish="ALLOW"><service>a</service></topics>'), "expected <topic>"),
    "element in a name": (policy('<topics publish="ALLOW"><topic>a<b/></topic></topics>'), "a name only"),
    "empty name": (policy('<topics publish="ALLOW"><topic/></topics>'), "is empty"),
    "blanks around a name": (policy('<topics publish="ALLOW"><topic> a </topic></topics>'), "blanks"),
    "tilde without slash": (policy('<topics publish="ALLOW"><topic>~a</topic></topics>'), "after '~'"),
    "relative namespace": (policy(profile='ns="a" node="n"'), "not an absolute namespace"),
    "bad node name": (policy(profile='ns="/" node="a b"'), "not a node name"),
    "no node": (policy(profile='ns="/"'), "needs the attribute node"),
    "enclave path empty, as in the LiSA listings": (policy(path=""), "not an enclave name"),
    "enclave path leaves the keystore": (policy(path="/a/../../b"), "not an enclave name"),
    "DOCTYPE": (policy(head="<!DOCTYPE policy>"), "DOCTYPE"),
    "entity bomb": (
        policy(head='<!DOCTYPE p [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]>', body="&b;"),
        "DOCTYPE",
    ),
    "include outside of a file": (
        policy('<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="a.xml"/>'),
        "only followed in a policy file",
    ),
}


@pytest.mark.parametrize("name", NOT_POLICIES)
def test_what_is_no_policy_is_told_with_its_line(name: str) -> None:
    text, reason = NOT_POLICIES[name]
    with pytest.raises(InvalidInputError, match=rf"p\.xml:?\d*: .*{re.escape(reason)}"):
        parse_policy(text.encode(), "p.xml")


def test_a_missing_file() -> None:
    with pytest.raises(PolicyError, match=r"cannot read policy .*No such file"):
        read_policy("/nonexistent/policy.xml")


WRITTEN = """\
<?xml version="1.0" encoding="UTF-8"?>
<policy version="0.2.0">
  <enclaves>
    <enclave path="/">
      <profiles>
        <profile ns="/" node="root"/>
      </profiles>
    </enclave>
    <enclave path="/a">
      <profiles>
        <profile ns="/" node="n">
          <topics publish="ALLOW">
            <topic>/b</topic>
            <topic>/c</topic>
          </topics>
          <topics publish="DENY">
            <topic>/d</topic>
          </topics>
          <services request="ALLOW">
            <service>/s</service>
          </services>
        </profile>
      </profiles>
    </enclave>
  </enclaves>
</policy>
"""


def test_a_policy_as_it_is_written() -> None:
    rules = (
        Rule(Operation.REQUEST, Qualifier.ALLOW, "/s"),
        Rule(Operation.PUBLISH, Qualifier.DENY, "/d"),
        Rule(Operation.PUBLISH, Qualifier.ALLOW, "/c"),
        Rule(Operation.PUBLISH, Qualifier.ALLOW, "/b"),
    )
    enclaves = (EnclavePolicy("/a", (Profile("/", "n", rules),)), EnclavePolicy("/", ()))
    assert policy_xml(Policy(enclaves)).decode() == WRITTEN


def test_a_policy_without_enclaves_cannot_be_written() -> None:
    with pytest.raises(InvalidInputError, match="at least one enclave"):
        policy_xml(Policy(()))


tokens = st.from_regex(r"[a-z_][a-z0-9_]{0,3}", fullmatch=True)
names = st.builds(lambda head, tail: head + tail, st.sampled_from(["", "/", "~/", "/*", "/[a-c]"]), tokens)
rules_strategy = st.builds(Rule, st.sampled_from(tuple(Operation)), st.sampled_from(tuple(Qualifier)), names)
profiles = st.builds(
    lambda node, rules: Profile("/ns", node, tuple(sorted(set(rules)))),
    tokens,
    st.lists(rules_strategy, max_size=6),
)
enclaves = st.builds(
    lambda name, found: EnclavePolicy(f"/{name}", tuple(sorted(found, key=lambda p: p.node))),
    tokens,
    st.lists(profiles, min_size=1, max_size=3, unique_by=lambda profile: profile.node),
)
policies = st.lists(enclaves, min_size=1, max_size=3, unique_by=lambda enclave: enclave.path).map(
    lambda found: Policy(tuple(sorted(found)))
)


@settings(max_examples=60, deadline=None)
@given(policies)
def test_what_is_written_is_valid_and_reads_back_the_same(policy: Policy) -> None:
    text = policy_xml(policy)
    parse_foreign(text, "policy.xsd", "p.xml", "policy")
    assert parse_policy(text).policy == policy
    assert policy_xml(parse_policy(text).policy) == text
    assert policy_xml(Policy(tuple(reversed(policy.enclaves)))) == text


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


XI = 'xmlns:xi="http://www.w3.org/2001/XInclude"'
NODE = '<profile><topics publish="ALLOW"><topic>rosout</topic></topics></profile>'


def include(href: str, pointer: str = "/profile/*", more: str = "") -> str:
    xpointer = f'xpointer="xpointer({pointer})"' if pointer else ""
    return f'<xi:include {XI} href="{href}" {xpointer} {more}/>'


def test_includes_of_common_profiles(tmp_path: Path) -> None:
    write(tmp_path, "common/node.xml", f"<profile>{include('more/log.xml')}</profile>")
    write(tmp_path, "common/more/log.xml", NODE)
    main = write(tmp_path, "policy.xml", policy(include("common/node.xml")))
    document = read_policy(main)
    (rule,) = document.policy.enclaves[0].profiles[0].rules
    assert rule.expression == "rosout"
    (place,) = document.places.values()
    assert place.startswith(f"{tmp_path}/common/more/log.xml:1, included from {tmp_path}/common/node.xml:1")


def test_includes_of_whole_enclaves_with_the_older_namespace(tmp_path: Path) -> None:
    write(tmp_path, "talker.xml", policy())
    text = include("talker.xml", "/policy/enclaves/*").replace("2001", "2003")
    main = write(tmp_path, "policy.xml", f'<policy version="0.2.0"><enclaves>{text}</enclaves></policy>')
    assert read_policy(main).policy == read(policy())


def test_the_same_file_may_be_included_in_several_places(tmp_path: Path) -> None:
    write(tmp_path, "log.xml", NODE)
    main = write(tmp_path, "policy.xml", policy(include("log.xml") + include("log.xml")))
    assert len(read_policy(main).policy.enclaves[0].profiles[0].rules) == 1


UNSAFE = {
    "a text file": (include("secret.txt", more='parse="text"'), "only read XML"),
    "a parent folder": (include("../outside.xml"), "outside the policy's folder"),
    "round about": (include("sub/../../outside.xml"), "outside the policy's folder"),
    "an absolute path": (include("/etc/passwd"), "not a relative path"),
    "a file URL": (include("file:///etc/passwd"), "not a relative path"),
    "the network": (include("http://example.org/p.xml"), "not a relative path"),
    "a link that leaves": (include("link.xml"), "outside the policy's folder"),
    "a file that is not there": (include("none.xml"), "cannot include"),
    "a file that is no XML": (include("secret.txt"), "not well-formed"),
    "itself": (include("policy.xml", "/policy/enclaves/enclave/profiles/profile/*"), "round in a circle"),
    "itself by another spelling": (
        include("sub/../policy.xml", "/policy/enclaves/enclave/profiles/profile/*"),
        "round in a circle",
    ),
    "two that include each other": (include("ping.xml"), "round in a circle"),
    "a pointer with functions": (include("log.xml", "document('/etc/passwd')"), "is not supported"),
    "a pointer to nothing": (include("log.xml", "/nothing/*"), "selects nothing"),
    "a fallback": (
        f'<xi:include {XI} href="none.xml"><xi:fallback/></xi:include>',
        "fallback is not supported",
    ),
}


@pytest.mark.parametrize("name", UNSAFE)
def test_includes_that_are_refused(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "policies"
    write(tmp_path, "outside.xml", NODE)
    write(folder, "log.xml", NODE)
    write(folder, "secret.txt", "the secret")
    write(folder, "sub/x.xml", NODE)
    write(folder, "ping.xml", f"<profile>{include('pong.xml')}</profile>")
    write(folder, "pong.xml", f"<profile>{include('ping.xml')}</profile>")
    (folder / "link.xml").symlink_to(tmp_path / "outside.xml")
    body, reason = UNSAFE[name]
    main = write(folder, "policy.xml", policy(body))
    with pytest.raises(InvalidInputError, match=re.escape(reason)) as caught:
        read_policy(main)
    assert "the secret" not in str(caught.value)


def test_includes_that_multiply_are_stopped(tmp_path: Path) -> None:
    for depth in range(14):
        write(tmp_path, f"f{depth}.xml", f"<profile>{include(f'f{depth + 1}.xml') * 3}</profile>")
    write(tmp_path, "f14.xml", NODE)
    with pytest.raises(PolicyError, match="more than 2000 includes"):
        read_policy(write(tmp_path, "policy.xml", policy(include("f0.xml"))))
