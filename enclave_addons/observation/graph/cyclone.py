"""Listens to a DDS domain with the Python binding of Cyclone DDS: no ROS, and nothing is published. Acts.

Participants of all vendors are seen. One observer for each process: Cyclone DDS 0.10 judges the endpoints of all
participants of a process by the permissions of the first.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from enclave_addons.observation.graph.discovery_info import TYPE_NAME, decode
from enclave_addons.observation.graph.model import (
    Graph,
    GraphState,
    SeenEndpoint,
    SeenParticipant,
    claimed_enclave,
)
from enclave_addons.observation.graph.udp_ports import UdpPorts
from enclave_addons.observation.graph.wire_names import DISCOVERY_TOPIC
from enclave_addons.review.quality import INFINITE, Quality
from nodl.errors import NoDLError

RANGE_VARIABLES = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "CYCLONEDDS_URI",
)
"""Variables that say where participants are looked for."""
_MOST_AT_ONCE = 4096
_MOST_PARTICIPANTS = 119  # of one domain on one host: what its ports have room for (DDSI-RTPS 9.6.1)
_LOOPBACK = '<NetworkInterface name="lo"/>'
_BOTH = f'<NetworkInterface autodetermine="true"/>{_LOOPBACK}'
_TYPE_HASH = b"typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"
"""Of rmw_dds_common/msg/ParticipantEntitiesInfo; nodes since Iron warn of an endpoint without one."""
_FILES = {
    "dds.sec.auth.identity_ca": "identity_ca.cert.pem",
    "dds.sec.auth.identity_certificate": "cert.pem",
    "dds.sec.auth.private_key": "key.pem",
    "dds.sec.access.permissions_ca": "permissions_ca.cert.pem",
    "dds.sec.access.governance": "governance.p7s",
    "dds.sec.access.permissions": "permissions.p7s",
}
_PLUGINS = {
    "dds.sec.auth": ("dds_security_auth", "authentication"),
    "dds.sec.crypto": ("dds_security_crypto", "crypto"),
    "dds.sec.access": ("dds_security_ac", "access_control"),
}


class ObserverError(NoDLError):
    """The domain cannot be observed; says why and what helps."""


class CycloneObserver:
    """Is up from its construction until ``close``; ``poll`` takes in what was announced since. Raises
    ``ObserverError`` where DDS refuses the participant, and ``ImportError`` without the binding."""

    def __init__(
        self, domain_id: int, environment: Mapping[str, str], enclave_directory: Path | None = None
    ) -> None:
        from cyclonedds.builtin import (
            BuiltinDataReader,
            BuiltinTopicDcpsParticipant,
            BuiltinTopicDcpsPublication,
            BuiltinTopicDcpsSubscription,
        )
        from cyclonedds.core import DDSException
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.qos import Policy, Qos

        properties = security_properties(enclave_directory) if enclave_directory else {}
        policies = [Policy.Property(name, value) for name, value in properties.items()]
        try:
            self._domain = _domain(domain_id, environment)
            self._participant = DomainParticipant(domain_id, Qos(*policies))
            self._lists = _list_reader(self._participant)
        except DDSException as error:
            raise ObserverError(_refused(domain_id, enclave_directory, error)) from error
        self._readers = [
            (BuiltinDataReader(self._participant, topic), read)
            for topic, read in (
                (BuiltinTopicDcpsParticipant, self._participant_seen),
                (BuiltinTopicDcpsPublication, partial(self._endpoint_seen, writes=True)),
                (BuiltinTopicDcpsSubscription, partial(self._endpoint_seen, writes=False)),
            )
        ]
        self._guids: dict[int, str] = {}  # by handle of the instance, for the notice that it ended
        self._vendors: dict[str, SeenParticipant] = {}
        self._ports = UdpPorts()
        self.state = GraphState(self._participant.guid.bytes.hex())

    def poll(self) -> int:
        """Poll once, and return how many changes there have been in all."""
        self._ports = UdpPorts()
        # Endpoints are fetched before participants, so that the participant of each is known when it is read.
        fetched = [(reader.take(N=_MOST_AT_ONCE), read) for reader, read in reversed(self._readers)]
        for samples, read in reversed(fetched):
            for sample in samples:
                self._take_in(sample, read)
        for message in self._lists.take(N=_MOST_AT_ONCE):
            listed = decode(getattr(message, "raw", b""))
            if listed is not None:
                writer = self._guids.get(message.sample_info.publication_handle, "")
                self.state.listed(listed, _participant_guid(writer))
        return self.state.changes

    def graph(self, *, past: bool = False) -> Graph:
        return self.state.graph(past=past)

    @property
    def forged(self) -> tuple[str, ...]:
        """Return the lists that were not believed, in words."""
        return tuple(self.state.forged)

    def close(self) -> None:
        """Remove the entities while the interpreter still works: DDS threads may be calling it until then."""
        readers = (reader for reader, _ in self._readers)
        for entity in (*readers, self._lists, self._participant, self._domain):
            entity._delete(entity._ref)

    def _take_in(self, sample: Any, read: Any) -> None:
        info = sample.sample_info
        if hasattr(sample, "key"):
            self._guids[info.instance_handle] = sample.key.bytes.hex()
            if sample.qos is not None:  # else only the notice that it ended is left
                read(sample)
        if not _alive(info):
            self.state.gone(self._guids.get(info.instance_handle, ""))

    def _participant_seen(self, sample: Any) -> None:
        seen = participant_from(sample.key.bytes.hex(), sample.qos)
        if seen.pid is None:
            pid = self._ports.pid(_properties(sample.qos).get("__NetworkAddresses", "").split(","))
            seen = seen._replace(pid=pid, host=socket.gethostname() if pid else seen.host)
        self._vendors[seen.guid] = seen
        self.state.participant(seen)

    def _endpoint_seen(self, sample: Any, *, writes: bool) -> None:
        participant = sample.participant_key.bytes.hex()
        owner = self._vendors.get(participant)
        quality = quality_from(sample.qos, has_history=bool(owner and owner.own_history))
        self.state.endpoint(
            SeenEndpoint(
                sample.key.bytes.hex(), participant, writes, sample.topic_name, sample.type_name, quality
            )
        )


def _domain(domain_id: int, environment: Mapping[str, str]) -> Any:
    """Make the domain; a machine that has only ``lo`` cannot name it beside the interface that is found by itself."""
    from cyclonedds.core import DDSException
    from cyclonedds.domain import Domain

    text = configuration(environment)
    try:
        return Domain(domain_id, text)
    except DDSException:
        if _BOTH not in text:
            raise
        return Domain(domain_id, text.replace(_BOTH, _LOOPBACK))


def configuration(environment: Mapping[str, str]) -> str:
    """Return the configuration for Cyclone DDS: ROS's variables as rmw_cyclonedds reads them, then the user's
    ``CYCLONEDDS_URI``, which wins.

    On this machine only, both of its addresses are used: nodes on Cyclone DDS up to Humble are at 127.0.0.1 alone,
    later ones at the machine's own address, and newer Fast DDS does not answer a peer that is at 127.0.0.1 alone.
    """
    local = (
        environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
        or environment.get("ROS_LOCALHOST_ONLY") == "1"
    )
    peers = [each for each in environment.get("ROS_STATIC_PEERS", "").split(";") if each]
    general = f"<Interfaces>{_BOTH}</Interfaces><AllowMulticast>false</AllowMulticast>" if local else ""
    addresses = (["127.0.0.1"] if local else []) + peers
    found = "".join(f"<Peer Address={quoteattr(each)}/>" for each in addresses)
    own = (
        f'<CycloneDDS><Domain Id="any"><General>{general}</General>'
        f"<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{_MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
        f"<Peers>{found}</Peers></Discovery></Domain></CycloneDDS>"
    )
    theirs = environment.get("CYCLONEDDS_URI", "")
    return f"{own},{theirs}" if theirs else own


def security_properties(directory: Path) -> dict[str, str]:
    """Return the properties of a participant in an enclave (rmw_dds_common ``security.cpp``); raises ObserverError."""
    missing = [name for name in _FILES.values() if not (directory / name).is_file()]
    if missing:
        raise ObserverError(f"{directory} is not the directory of an enclave: it has no {', '.join(missing)}")
    properties = {key: f"file:{directory / name}" for key, name in _FILES.items()}
    if (directory / "crl.pem").is_file():
        properties["org.eclipse.cyclonedds.sec.auth.crl"] = f"file:{directory / 'crl.pem'}"
    for prefix, (library, what) in _PLUGINS.items():
        properties[f"{prefix}.library.path"] = _library(library)
        properties[f"{prefix}.library.init"] = f"init_{what}"
        properties[f"{prefix}.library.finalize"] = f"finalize_{what}"
    return properties


def _library(name: str) -> str:
    """Find the plugin: Debian keeps them in a folder beside libddsc that the loader does not search."""
    loaded = re.findall(r"(/\S*)/libddsc\.so", Path("/proc/self/maps").read_text(encoding="utf-8"))
    for place in dict.fromkeys(loaded):
        for path in sorted(Path(place).glob(f"libddsc*/**/lib{name}.so")):
            return str(path)
    return name


def participant_from(guid: str, qos: Any) -> SeenParticipant:
    """Return what the participant's QoS says of it; never its security properties, which name files of keys."""
    properties = _properties(qos)
    user_data = next((bytes(each.data) for each in qos if type(each).__qualname__ == "Policy.Userdata"), b"")
    pid = properties.get("__Pid") or properties.get("fastdds.physical_data.process", "")
    host = properties.get("__Hostname") or properties.get("fastdds.physical_data.host", "")
    return SeenParticipant(
        guid,
        claimed_enclave(user_data),
        int(pid) if pid.isdigit() else None,
        host.partition(":")[0],
        properties.get("__ProcessName", ""),
        _is_cyclone(guid, properties),
    )


def _properties(qos: Any) -> dict[str, str]:
    return {each.key: each.value for each in qos if type(each).__qualname__ == "Policy.Property"}


def _is_cyclone(guid: str, properties: Mapping[str, str]) -> bool:
    # Vendor numbers begin unsecured GUIDs (DDSI-RTPS: eProsima has 01.0f); physical data is announced in clear.
    return not guid.startswith("010f") and not any(name.startswith("fastdds.") for name in properties)


def quality_from(qos: Any, *, has_history: bool) -> Quality:
    """Return the quality of an endpoint; Fast DDS does not announce its history."""
    fields: dict[str, Any] = {}
    for policy in qos:
        reader = _POLICIES.get(policy.__scope__)
        if reader is not None:
            fields.update(reader(_word(type(policy)), policy))
    if not has_history:
        fields.update(history="", depth=0)
    return Quality(**fields)


_POLICIES: Mapping[str, Callable[[str, Any], dict[str, Any]]] = {
    "Reliability": lambda word, _: {"reliability": word},
    "Durability": lambda word, _: {"durability": word},
    "History": lambda word, policy: {"history": word, "depth": getattr(policy, "depth", 0)},
    "Deadline": lambda _, policy: {"deadline": _duration(policy.deadline)},
    "Liveliness": lambda word, policy: {"liveliness": word, "lease": _duration(policy.lease_duration)},
    "Ownership": lambda word, _: {"ownership": word},
}


def _word(policy: type) -> str:
    name = policy.__qualname__.rpartition(".")[2]
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper()


def _duration(nanoseconds: int) -> int:
    return INFINITE if nanoseconds >= (1 << 63) - 1 else nanoseconds


def _alive(info: Any) -> bool:
    from cyclonedds.core import InstanceState

    return bool(info.instance_state == InstanceState.Alive)


def _participant_guid(endpoint: str) -> str:
    """Return the participant's GUID: its entity id is fixed (DDSI-RTPS 9.3.1.5)."""
    return f"{endpoint[:24]}000001c1" if endpoint else ""


def _list_reader(participant: Any) -> Any:
    """Make a reader that hands out the bytes of each message: peers of both sizes must be understood.

    What rmw sends carries no description of its type, which this binding always adds to its own; with it, peers whose
    description differs would not match. So it is left empty.
    """
    from cyclonedds.idl import make_idl_struct
    from cyclonedds.idl.types import sequence, uint8
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    message: Any = make_idl_struct("ParticipantEntitiesInfo", TYPE_NAME, {"content": sequence[uint8]})  # type: ignore[misc]
    message.__idl__._xt_data = (message, message)
    message.__idl__._xt_bytedata = (b"", b"")
    message.deserialize = classmethod(lambda cls, data, **_: _Raw(data))
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    qos = Qos(reliable, Policy.Durability.TransientLocal, Policy.History.KeepAll, Policy.Userdata(_TYPE_HASH))
    return DataReader(participant, Topic(participant, DISCOVERY_TOPIC, message), qos)


class _Raw:
    def __init__(self, raw: bytes) -> None:
        self.raw = bytes(raw)


def _refused(domain_id: int, directory: Path | None, error: Exception) -> str:
    if directory is None:
        return f"DDS domain {domain_id} cannot be joined: {error}"
    return (
        f"DDS domain {domain_id} cannot be joined with the enclave in {directory}: {error}. Is the domain in its "
        "governance, and is the enclave still valid? secure-keystore tool-enclave KEYSTORE --for observe makes one"
    )
