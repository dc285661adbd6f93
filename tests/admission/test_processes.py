"""Middleware, domain and variables of each process, from its own environment."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import EnclaveLaunchError, LaunchPlan, SecurityOptions, provision
from enclave_launch.diagnostics import Code
from enclave_launch.report.tree import plan_tree
from keystore import Domains, ProvisionOptions

from .conftest import Plan

TALKER = '<node pkg="demo_nodes" exec="talker">{}</node>'
PYTHON_NODE = "entities = [Node(package='demo_nodes', executable='talker', {})]"


def codes(plan: LaunchPlan) -> list[Code]:
    return [problem.code for problem in plan.problems]


WAYS = {
    "set_env": '<set_env name="{}" value="{}"/>' + TALKER.format(""),
    "env of the node": TALKER.format('<env name="{}" value="{}"/>'),
    "env of a group": '<group><set_env name="{}" value="{}"/>' + TALKER.format("") + "</group>",
    "additional_env": PYTHON_NODE.format("additional_env={{{!r}: {!r}}}"),
    "an environment of its own": PYTHON_NODE.format("env={{{!r}: {!r}}}"),
    "an include": "entities = [SetEnvironmentVariable({!r}, {!r}), "
    "Node(package='demo_nodes', executable='talker')]",
}


@pytest.mark.parametrize("way", WAYS)
def test_a_middleware_that_reads_no_enclaves_is_refused_with_the_reason(way: str, plan: Plan) -> None:
    found = plan(WAYS[way].format("RMW_IMPLEMENTATION", "rmw_iceoryx_cpp"))
    (problem,) = found.problems
    assert problem.code is Code.MIDDLEWARE_REFUSED and "has no security of its own" in problem.text
    assert problem.location is not None and problem.location.element in ("node", "Node")
    assert not plan(WAYS[way].format("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")).problems


def test_the_environment_counts_and_only_one_node_may_differ(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_iceoryx_cpp")
    other = '<env name="RMW_IMPLEMENTATION" value="rmw_fastrtps_dynamic_cpp"/>'
    (problem,) = plan(TALKER.format("") + TALKER.format(other)).problems
    assert problem.subject == "talker-1" and "RMW_IMPLEMENTATION of the environment" in problem.text


def test_an_unknown_middleware_needs_somebody_to_vouch_for_it(plan: Plan) -> None:
    text = TALKER.format('<env name="RMW_IMPLEMENTATION" value="rmw_new_cpp"/>')
    (problem,) = plan(text).problems
    assert problem.remedy.endswith("--accept-middleware rmw_new_cpp")
    assert not plan(text, accept_middlewares=("rmw_new_cpp",)).problems
    known = text.replace("rmw_new_cpp", "rmw_iceoryx_cpp")
    assert plan(known, accept_middlewares=("rmw_iceoryx_cpp",)).problems


def test_of_connext_is_said_what_is_known(plan: Plan) -> None:
    found = plan(TALKER.format('<env name="RMW_IMPLEMENTATION" value="rmw_connextdds"/>'))
    assert not found.problems and [note.code for note in found.warnings] == [Code.CONNEXT_UNTRIED]


def test_a_program_that_is_no_node_may_use_what_it_likes(plan: Plan) -> None:
    """rcl looks for the enclave before it loads a middleware: without one a ROS program ends."""
    text = '<executable cmd="true"{}><env name="RMW_IMPLEMENTATION" value="rmw_iceoryx_cpp"/></executable>'
    assert not plan(text.format("")).problems
    assert codes(plan(text.format(' enclave="/x"'))) == [Code.MIDDLEWARE_REFUSED]


@pytest.mark.parametrize("way", WAYS)
def test_permissions_and_governance_are_for_the_domain_of_the_process(
    way: str, plan: Plan, tmp_path: Path
) -> None:
    found = plan(WAYS[way].format("ROS_DOMAIN_ID", "57"))
    assert found.processes[0].domain == 57 and ", domain 57" in plan_tree(found)
    provision(found, tmp_path / "ks")
    permissions = (tmp_path / "ks/enclaves/permissions.xml").read_text()
    assert "<id>57</id>" in permissions and "<id>0</id>" not in permissions
    assert b"<id>57</id>" in (tmp_path / "ks/enclaves/governance.p7s").read_bytes()


TWO_DOMAINS = (
    '<node pkg="demo_nodes" exec="talker" enclave="/a"><env name="ROS_DOMAIN_ID" value="3"/></node>'
    '<node pkg="demo_nodes" exec="listener" enclave="{}"><env name="ROS_DOMAIN_ID" value="7"/></node>'
)


def test_each_enclave_gets_the_domains_of_its_own_processes(plan: Plan, tmp_path: Path) -> None:
    found = plan(TWO_DOMAINS.format("/b"))
    assert not found.warnings
    provision(found, tmp_path / "ks")
    first = (tmp_path / "ks/enclaves/a/permissions.xml").read_text()
    assert "<id>3</id>" in first and "<id>7</id>" not in first
    governance = (tmp_path / "ks/enclaves/governance.p7s").read_bytes()
    assert b"<id>3</id>" in governance and b"<id>7</id>" in governance


def test_an_enclave_in_two_domains_is_told(plan: Plan) -> None:
    (warning,) = plan(TWO_DOMAINS.format("/a")).warnings
    assert warning.code is Code.DOMAINS_SHARED
    assert "domains 3, 7" in warning.text and "talker-1 in 3, listener-2 in 7" in warning.text


def test_a_domain_that_was_not_asked_for_is_refused_with_both_places(plan: Plan, tmp_path: Path) -> None:
    found = plan(TWO_DOMAINS.format("/b"))
    options = SecurityOptions(keystore=ProvisionOptions(domains=Domains.parse("3")))
    with pytest.raises(EnclaveLaunchError) as refused:
        provision(found, tmp_path / "ks", options=options)
    assert "listener-2 is in domain 7, but --domain-id" in str(refused.value)
    assert f"{tmp_path}/test.launch.xml:2" in str(refused.value) and "talker" not in str(refused.value)
    assert not (tmp_path / "ks").exists()
    both = SecurityOptions(keystore=ProvisionOptions(domains=Domains.parse("0-10")))
    provision(found, tmp_path / "ks", options=both)


@pytest.mark.parametrize(
    ("value", "domain"), [("0", 0), ("7", 7), ("230", 230), ("010", 8), ("00", 0), ("0x1F", 31), ("", 0)]
)
def test_a_domain_is_read_as_rcl_reads_it(value: str, domain: int, plan: Plan) -> None:
    """``strtoul`` with base 0 (rcl domain_id.c)."""
    found = plan(TALKER.format(f'<env name="ROS_DOMAIN_ID" value="{value}"/>'))
    assert (found.processes[0].domain, found.problems) == (domain, ())


@pytest.mark.parametrize("value", ["abc", "231", "-1", "1 2", "08", "0o7", "0x", "0xE7"])
def test_an_impossible_domain_is_a_problem_with_its_place(value: str, plan: Plan) -> None:
    found = plan(TALKER.format(f'<env name="ROS_DOMAIN_ID" value="{value}"/>'))
    assert codes(found) == [Code.DOMAIN_INVALID]
    assert not plan(TALKER.format('<env name="ROS_DOMAIN_ID" value=""/>')).problems


@pytest.mark.parametrize(
    "name",
    [
        "ROS_SECURITY_ENABLE",
        "ROS_SECURITY_KEYSTORE",
        "ROS_SECURITY_STRATEGY",
        "ROS_SECURITY_ENCLAVE_OVERRIDE",
    ],
)
def test_a_security_variable_of_the_launch_file_is_told_to_have_no_effect(name: str, plan: Plan) -> None:
    (warning,) = plan(TALKER.format(f'<env name="{name}" value="x"/>')).warnings
    assert not plan(TALKER.format('<env name="ZENOH_CONFIG_OVERRIDE" value="x"/>')).warnings, (
        "no matter on DDS"
    )
    assert warning.code is Code.VARIABLE_OVERRIDDEN and f"{name}=x" in warning.text


def test_a_preloaded_library_is_told(plan: Plan) -> None:
    (warning,) = plan(TALKER.format('<env name="LD_PRELOAD" value="libspy.so"/>')).warnings
    assert warning.code is Code.LIBRARY_PRELOADED


def test_a_dds_configuration_with_security_of_its_own_is_refused(plan: Plan, tmp_path: Path) -> None:
    secured = tmp_path / "secured.xml"
    secured.write_text("<CycloneDDS><Domain><Security><AccessControl/></Security></Domain></CycloneDDS>")
    plain = tmp_path / "plain.xml"
    plain.write_text("<CycloneDDS><Domain><Tracing/></Domain></CycloneDDS>")
    fast = tmp_path / "fast.xml"
    fast.write_text("<property><name>dds.sec.auth.plugin</name></property>")
    refused = {
        "CYCLONEDDS_URI": (
            f"file://{secured}",
            f"{plain},{secured}",
            f"{plain}, {secured}",
            f"{secured},<CycloneDDS/>",
            f"<CycloneDDS/>,file://{secured}",
            "<Security><Authentication/></Security>",
            "<Domain><!-- one, two --><Security/></Domain>",
        ),
        "FASTRTPS_DEFAULT_PROFILES_FILE": (str(fast),),
    }
    for name, values in refused.items():
        for value in values:
            text = TALKER.format(f'<env name="{name}" value="{value.replace("<", "&lt;")}"/>')
            assert codes(plan(text)) == [Code.SECURITY_CONFIGURED], value
        assert not plan(TALKER.format(f'<env name="{name}" value="{plain}"/>')).problems
    for name in ("CYCLONEDDS_URI", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE"):
        for unread in ("/no/such/file", "${HOME}", "file://${HOME}/c.xml"):
            text = TALKER.format(f'<env name="{name}" value="{unread}"/>')
            assert codes(plan(text)) == [Code.SECURITY_CONFIGURED], (name, unread)


SERVER = "<dds><discoveryProtocol>CLIENT</discoveryProtocol></dds>"


@pytest.mark.parametrize(
    ("name", "value", "is_refused"),
    [
        ("CYCLONEDDS_URI", "&lt;Domain>${PART}&lt;/Domain>", True),
        ("CYCLONEDDS_URI", "&lt;Domain>${NONE:-&lt;Security/>}&lt;/Domain>", True),
        ("CYCLONEDDS_URI", "&lt;Domain>${PLAIN}&lt;Peers>a,b,c&lt;/Peers>&lt;/Domain>", False),
        ("CYCLONEDDS_URI", "&lt;A/>,c.xml,&lt;B/>", True),
        ("CYCLONEDDS_URI", "file://c.xml", True),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "server.xml", True),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "plain.xml", False),
        ("FASTDDS_ENVIRONMENT_FILE", "server.json", True),
        ("FASTDDS_ENVIRONMENT_FILE", "plain.json", False),
    ],
)
def test_a_dds_configuration_is_found_where_the_middleware_finds_it(
    plan: Plan, tmp_path: Path, name: str, value: str, is_refused: bool
) -> None:
    """Relative to the working directory of the node, with parts from the environment, between others."""
    (tmp_path / "c.xml").write_text("<Domain><Security/></Domain>")
    (tmp_path / "server.xml").write_text(SERVER)
    (tmp_path / "plain.xml").write_text("<dds><discoveryProtocol>SIMPLE</discoveryProtocol></dds>")
    (tmp_path / "server.json").write_text('{"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"}')
    (tmp_path / "plain.json").write_text('{"FASTDDS_STATISTICS": "x"}')
    variables = {"PART": "&lt;Security/>", "PLAIN": "&lt;Tracing/>", name: value}
    inner = "".join(f'<env name="{each}" value="{text}"/>' for each, text in variables.items())
    text = TALKER.replace("<node ", f'<node cwd="{tmp_path}" ', 1).format(inner)
    code = Code.DISCOVERY_SERVER if value.startswith("server") else Code.SECURITY_CONFIGURED
    assert codes(plan(text)) == ([code] if is_refused else [])


def test_a_discovery_server_is_refused_on_fast_dds_with_the_cure(plan: Plan) -> None:
    server = '<env name="ROS_DISCOVERY_SERVER" value="{}"/><env name="RMW_IMPLEMENTATION" value="{}"/>'
    (problem,) = plan(TALKER.format(server.format("127.0.0.1:11811", "rmw_fastrtps_cpp"))).problems
    assert problem.code is Code.DISCOVERY_SERVER
    assert "never meet: 127.0.0.1:11811" in problem.text and "ROS_STATIC_PEERS" in problem.remedy
    for address, middleware in (("", "rmw_fastrtps_cpp"), ("127.0.0.1:11811", "rmw_cyclonedds_cpp")):
        assert not plan(TALKER.format(server.format(address, middleware))).problems


def test_a_server_of_the_shell_counts_and_one_that_the_launch_takes_away_does_not(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "127.0.0.1:11811")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    assert codes(plan(TALKER.format(""))) == [Code.DISCOVERY_SERVER]
    assert codes(plan(TALKER.format('<env name="ROS_DISCOVERY_SERVER" value=""/>'))) == []


@pytest.mark.parametrize("protocol", ["NONE", "STATIC"])
def test_profiles_that_switch_discovery_off(plan: Plan, tmp_path: Path, protocol: str) -> None:
    (tmp_path / "p.xml").write_text(f"<dds><discoveryProtocol>{protocol}</discoveryProtocol></dds>")
    text = TALKER.format(f'<env name="FASTRTPS_DEFAULT_PROFILES_FILE" value="{tmp_path}/p.xml"/>')
    assert codes(plan(text)) == [Code.DISCOVERY_SERVER]


def test_discovery_that_is_off_is_a_warning(plan: Plan) -> None:
    text = '<env name="ROS_AUTOMATIC_DISCOVERY_RANGE" value="{}"/>'
    for value, expected in (("OFF", True), ("LOCALHOST", False), ("SUBNET", False)):
        found = plan(TALKER.format(text.format(value)))
        assert not found.problems
        assert (Code.DISCOVERY_OFF in {each.code for each in found.warnings}) is expected


def test_default_profiles_in_the_working_directory_of_a_node(plan: Plan, tmp_path: Path) -> None:
    text = TALKER.replace("<node ", f'<node cwd="{tmp_path}" ', 1)
    assert codes(plan(text.format(""))) == []
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").write_text(SERVER)
    assert codes(plan(text.format(""))) == [Code.DISCOVERY_SERVER]
    assert codes(plan(text.format('<env name="SKIP_DEFAULT_XML_FILE" value="1"/>'))) == []


def test_the_launchers_own_node_needs_such_a_middleware_too(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It loads components and changes states from an enclave of its own, in the launcher's environment."""
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_iceoryx_cpp")
    text = (
        '<node_container pkg="demo_nodes" exec="component_container" name="box" namespace="">'
        '<env name="RMW_IMPLEMENTATION" value="rmw_cyclonedds_cpp"/>{}</node_container>'
    )
    component = '<composable_node pkg="demo_nodes" plugin="demo_nodes::Talker" name="talker"/>'
    refused = [one for one in plan(text.format(component)).problems if one.code is Code.MIDDLEWARE_REFUSED]
    assert [one.subject for one in refused] == ["the launcher's own node"]
    assert Code.MIDDLEWARE_REFUSED not in codes(plan(text.format("")))
