"""What a router refused is explained from its log: who, what, why, and the policy that allows it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.zenoh.denials import RUST_LOG, Explanation, RouterLog, RouterLogExplainer, meaning
from keystore import RenewOptions, renew
from keystore.verb import main
from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import Grants, keystore_of
from tests.addons.zenoh.kit import token, topic, wait_for
from tests.addons.zenoh.workspace import ROUTER, Workspace
from tests.keystore.kit import filled, options

SYSTEM: Grants = {
    "/talker": {"publish": ("/chatter",)},
    "/listener": {"subscribe": ("/chatter",)},
    "/server": {"reply": ("/add",)},
}


class Logged:
    """A router process with its trace log in a file, and what was explained of it so far."""

    def __init__(self, root: Path):
        self.keystore = keystore_of(root / "ks", SYSTEM)
        self.file = root / "router.log"
        variables = {
            "ZENOH_ROUTER_CONFIG_URI": str(self.keystore / "zenoh/router.json5"),
            "RUST_LOG": RUST_LOG,
        }
        with self.file.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", ROUTER], env={**os.environ, **variables}, stdout=log, stderr=log
            )

    def session(self, enclave: str) -> Any:
        return kit.opened(kit.session_text(self.keystore, enclave))

    def explained(self) -> list[Explanation]:
        return told(self.keystore, self.file.read_text())

    def tells(self, text: str) -> Explanation:
        """Waits until a refusal of this kind is in the log."""
        assert wait_for(lambda: any(text in "\n".join(said.lines) for said in self.explained())), text
        return next(said for said in self.explained() if text in "\n".join(said.lines))


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Logged]:
    made = Logged(tmp_path_factory.mktemp("denials"))
    yield made
    made.process.kill()
    made.process.wait()


def test_a_message_is_explained_with_the_policy_that_allows_it(logged: Logged) -> None:
    with kit.closing(talker := logged.session("/talker")):
        talker.put(topic("/chatter"), "granted")
        talker.put(topic("/secret"), "not granted")
        said = logged.tells("publish /secret (std_msgs/msg/String)")
    assert said.who == "enclave /talker" and "do not grant" in said.why
    assert '<topics publish="ALLOW">' in said.policy and "<topic>/secret</topic>" in said.policy
    assert not any("/chatter" in one.what for one in logged.explained())


def test_tokens_tell_which_node_it_is_and_a_node_is_told_of_once(logged: Logged) -> None:
    with kit.closing(listener := logged.session("/listener")):
        held = listener.liveliness().declare_token(token("/listener", "MS", "/news", node="reader"))
        kept = listener.declare_subscriber(topic("/news"), lambda sample: None)
        said = logged.tells("subscribe /news")
        assert kept is not None and held is not None
    assert said.who == "node /reader of enclave /listener"
    assert '<profile ns="/" node="reader">' in said.policy
    assert sum("/news" in one.what for one in logged.explained()) == 1


def test_calls_servers_and_actions_are_told_as_ros_has_them(logged: Logged) -> None:
    goal = "0/plan/_action/send_goal/test_msgs::action::dds_::Fibonacci_SendGoal_/RIHS01_0"
    with kit.closing(talker := logged.session("/talker")):
        kit.answers(talker, topic("/add", type_and_hash=kit.TRIGGER))
        kept = kit.serving(talker, topic("/add", type_and_hash=kit.TRIGGER), "forged")
        kit.answers(talker, goal)
        assert logged.tells("call /add (std_srvs/srv/Trigger)") and logged.tells(
            "serve /add (std_srvs/srv/Trigger)"
        )
        said = logged.tells("call action /plan")
        assert kept is not None
    assert '<actions call="ALLOW">' in said.policy and "<action>/plan</action>" in said.policy


def test_what_more_rights_are_no_answer_to_gets_no_policy(logged: Logged) -> None:
    with kit.closing(talker := logged.session("/talker")):
        talker.put("0/**", "everything")
        talker.put("1/chatter/std_msgs::msg::dds_::String_/RIHS01_0", "another domain")
        kept = talker.liveliness().declare_token(token("/listener", "NN"))
        several = logged.tells("many names at once")
        domain = logged.tells("in domain 1")
        name = logged.tells("says that it is enclave /listener")
        assert kept is not None
    assert "0/**" in several.what and "granted is another type or domain: publish /chatter" in domain.why
    assert "--enclave" in name.remedy and not several.policy + domain.policy + name.policy


def test_who_is_turned_away_at_the_door_is_told_with_the_reason(logged: Logged, tmp_path: Path) -> None:
    other = filled(tmp_path / "other", ("/talker",))
    main(["zenoh", str(other), "--router", _address(logged.keystore)])
    assert not kit.opens(kit.session_text(other, "/talker"))
    assert "different keystores" in logged.tells("UnknownCA").why
    plain = json.loads(kit.session_text(logged.keystore, "/talker"))
    del plain["transport"]["link"]["tls"]["connect_certificate"]
    del plain["transport"]["link"]["tls"]["connect_private_key"]
    assert not kit.opens(json.dumps({**plain, "transport": _without_mtls(plain["transport"])}))
    assert "it has no certificate" in logged.tells("no certificates").why


def _address(keystore: Path) -> str:
    return str(json.loads((keystore / "zenoh/router.json5").read_text())["metadata"]["address"])


def _without_mtls(transport: dict[str, Any]) -> dict[str, Any]:
    transport["link"]["tls"]["enable_mtls"] = False
    return transport


ZENOHD = """\
[rmw_zenohd] \\x1b[2m2026-11-22T04:58:47.321678Z\\x1b[0m \\x1b[35mTRACE\\x1b[0m  rx-0 ThreadId(08) \
\\x1b[2mzenoh::net::routing::interceptor::access_control\\x1b[0m\\x1b[2m:\\x1b[0m fc3d60eb on Interface(lo)+\
CertCommonName(ros.a)+Transport(Tls)+fc3d60eb is unauthorized to Query (ingress) on 0/never_asked/a::srv::dds_::B_/R
[rmw_zenohd] 2026-11-22T04:58:47.321700Z TRACE  rx-1 ThreadId(09) zenoh::net::routing::interceptor: Msg intercepted!
2026-11-22T04:58:47.321715Z TRACE  rx-0 ThreadId(08) zenoh::net::routing::interceptor::access_control: \
Using cached result: fc3d60eb is unauthorized to Put (ingress) on 0/secret/std_msgs::msg::dds_::String_/RIHS01_df66
2026-11-22T04:58:47.321718Z TRACE  rx-0 ThreadId(08) zenoh::net::routing::interceptor: Msg intercepted!
2026-11-22T04:58:47.321720Z TRACE  rx-0 ThreadId(08) zenoh::net::routing::interceptor::access_control: \
Using cached result: fc3d60eb is unauthorized to Liveliness Token (ingress) on 0/x/a::msg::dds_::B_/R/@adv/sub/fc/32/_
2026-11-22T04:58:47.321722Z TRACE  rx-0 ThreadId(08) zenoh::net::routing::interceptor: Msg intercepted!
"""
"""Shortened lines of rmw_zenohd 0.2.10 (Zenoh 1.8.0), in colour as launch passes it on, and without. The first is of a
cache; the second belongs to another thread; the token at the end is of no use to anybody."""


def told(keystore: Path, log: str) -> list[Explanation]:
    return [said for said in map(RouterLogExplainer(keystore).read, log.splitlines()) if said]


def test_only_what_was_sent_and_dropped_counts_in_the_log_of_rmw_zenohd(tmp_path: Path) -> None:
    keystore = filled(tmp_path / "ks", ("/a",))
    main(["zenoh", str(keystore)])
    assert [(said.who, said.what) for said in told(keystore, ZENOHD)] == [
        ("enclave /a", "publish /secret (std_msgs/msg/String)")
    ]


def test_a_name_of_before_and_rules_of_before_are_told_as_such(tmp_path: Path) -> None:
    keystore = filled(tmp_path / "ks", ("/a", "/b"))
    main(["zenoh", str(keystore)])
    renew(keystore, ["/a"], options=RenewOptions(revoke_old=True, provisioning=options()))
    (former,) = told(keystore, ZENOHD)
    assert former.who == "the certificate name ros.a" and "this name was of enclave /a" in former.why
    (granted,) = told(keystore, ZENOHD.replace("ros.a", "ros.b").replace("secret", "chatter"))
    assert "the router had other rules" in granted.why and not granted.policy
    main(["create-enclave", str(keystore), "/on_dds"])
    for name in ("ros.x", "ros.on_dds"):
        (nobody,) = told(keystore, ZENOHD.replace("ros.a", name))
        assert "no enclave that is on Zenoh here has this name" in nobody.why


HANDSHAKES = {
    "certificate expired: verification time 1795327740 (UNIX), but certificate is not valid after 17953": "has expired",
    "UnknownIssuer": "another CA",
    "certificate does not allow extended key usage for client authentication, allows server auth": "for no client",
    "BadSignature": "does not accept its certificate",
}


@pytest.mark.parametrize("said", HANDSHAKES)
def test_why_a_certificate_was_not_accepted_is_told(tmp_path: Path, said: str) -> None:
    """Lines of rmw_zenohd 0.2.10; its hint about open files has nothing to do with it."""
    keystore = filled(tmp_path / "ks", ("/a",))
    line = f"2026-11-22T06:12:01Z  WARN acc-0 ThreadId(05) zenoh_link_tls::unicast: invalid peer certificate: {said}"
    (one,) = told(keystore, f"{line}. Hint: increase the system open file limit.")
    assert HANDSHAKES[said] in one.why and "Hint" not in one.who
    assert told(keystore, line.replace(f"invalid peer certificate: {said}", "tls handshake eof")) == []


def test_a_key_that_looks_like_a_line_of_the_log_is_only_a_key(tmp_path: Path) -> None:
    keystore = filled(tmp_path / "ks", ("/a", "/b"))
    main(["zenoh", str(keystore)])
    claim = "zenoh::net::routing::interceptor: Msg intercepted!"
    assert told(keystore, ZENOHD.replace("Msg intercepted!", "").replace("_/RIHS01_df66", f"_/{claim}")) == []
    names = ZENOHD.replace(
        "RIHS01_df66", "R on Interface(lo)+CertCommonName(ros.b) is unauthorized to Put (ingress) on 0/x"
    )
    assert [said.who for said in told(keystore, names)] == ["enclave /a"]


def test_secure_launch_explains_what_its_router_traces_and_does_not_print_the_trace(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.at_a_free_port()
    done = workspace.secure_launch(workspace.launch_file(), RUST_LOG=RUST_LOG)
    assert done.returncode == 0 and "heard ['hello']" in done.stdout, done.stdout
    assert "enclave /talker may not publish /secret (std_msgs/msg/String)" in done.stdout
    assert "granted is another type or domain: publish /chatter (std_msgs/msg/String)" in done.stdout
    assert "caching permissions" not in done.stdout and "no certificates" not in done.stdout


@given(st.text(), st.sampled_from(["ingress", "egress"]), st.text())
def test_no_text_of_a_log_is_an_error(line: str, flow: str, key: str) -> None:
    log = RouterLog()
    for text in (
        line,
        f"interceptor::access_control: 1f is unauthorized to Put ({flow}) on {key}",
        f"interceptor{line}",
    ):
        log.read(text)
        log.read("interceptor: Msg intercepted!")
    for message in ("put", "reply", "liveliness_token", line):
        for one in (key, f"0/{key}", f"@ros2_lv/{key}", f"0/{key}/@adv/{key}"):
            found = meaning(flow, message, one)
            assert found is None or str(found).startswith(
                ("publish", "subscribe", "call", "serve", "say", "look")
            )
