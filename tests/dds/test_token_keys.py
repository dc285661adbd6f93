"""An enclave's key in a PKCS#11 token (REP 2015): Fast DDS signs with it there; Cyclone DDS 0.10 cannot.

SoftHSM stands for the token. The enclave was requested, signed and imported as on a robot; no file has its private key.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from glob import glob
from pathlib import Path

import pytest

from enclave_addons.deployment import ImportOptions, export_hosts, import_bundle, pinned, sign_requests
from enclave_addons.deployment.host_keys import parse_requests
from keystore import EnclavePolicy, Operation, ProvisionOptions
from tests.dds.conftest import missing
from tests.dds.our_keystore import allow, node, provision
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

MODULES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib/x86_64-linux-gnu/softhsm/libsofthsm2.so")
ENGINE = "/usr/lib/*/engines-3/pkcs11.so"
PIN = "1234"
KEY = "pkcs11:token=robot;object=speaker;type=private"


@pytest.fixture
def token(tmp_path: Path) -> dict[str, str]:
    """A token with one key, as an environment that finds it."""
    module = next((path for path in MODULES if os.path.exists(path)), None)
    if module is None or shutil.which("softhsm2-util") is None:
        missing("SoftHSM", "apt-get install softhsm2")
    if not glob(ENGINE):
        missing("OpenSSL's engine for tokens", "apt-get install libengine-pkcs11-openssl")
    (tmp_path / "tokens").mkdir()
    (tmp_path / "softhsm.conf").write_text(f"directories.tokendir = {tmp_path / 'tokens'}\n")
    found = {"SOFTHSM2_CONF": str(tmp_path / "softhsm.conf"), "PKCS11_MODULE_PATH": str(module)}

    def run(*command: str) -> None:
        subprocess.run(command, check=True, capture_output=True, env={**os.environ, **found})

    softhsm = ("softhsm2-util", "--pin", PIN)
    run(*softhsm, "--init-token", "--free", "--label", "robot", "--so-pin", "12345678")
    key = str(tmp_path / "key.pem")
    run("openssl", "genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", key)
    run(*softhsm, "--import", key, "--token", "robot", "--label", "speaker", "--id", "01")
    os.unlink(key)
    return found


def asked_for(host: Path, token: dict[str, str], tmp_path: Path) -> Path:
    """The file with the request; in a process of its own, since SoftHSM reads its configuration once in each."""
    (tmp_path / "pin").write_text(PIN)
    command = [
        "secure-keystore",
        "request",
        str(host),
        "/speaker",
        "--token",
        KEY,
        "--pin-file",
        str(tmp_path / "pin"),
    ]
    program = f"import sys; sys.argv = {command!r}; from keystore.verb import main; sys.exit(main())"
    done = subprocess.run([sys.executable, "-c", program], env={**os.environ, **token}, capture_output=True)
    assert done.returncode == 0, done.stderr
    (tmp_path / "requests.pem").write_bytes(done.stdout)
    return tmp_path / "requests.pem"


@pytest.fixture
def enclaves(tmp_path: Path, token: dict[str, str], domain_id: int) -> Path:
    talker = node("/", "speaker", *allow(Operation.PUBLISH, "/chatter"))
    listener = node("/", "ear", *allow(Operation.SUBSCRIBE, "/chatter"))
    policies = [EnclavePolicy("/speaker", (talker,)), EnclavePolicy("/ear", (listener,))]
    provision(tmp_path / "ca", domain_id, policies)
    requests = parse_requests(asked_for(tmp_path / "ks", token, tmp_path).read_bytes(), "requests")
    signing = ProvisionOptions(durable=False)
    sign_requests(tmp_path / "ca", requests, options=signing)
    bundle = export_hosts(tmp_path / "ca", tmp_path / "out", {"robot": ["*"]})[0]
    pins = ImportOptions("robot", pinned(bundle.manifest))
    import_bundle(tmp_path / "ks", bundle.path, options=pins)
    assert not (tmp_path / "ks/enclaves/speaker/key.pem").exists()
    return tmp_path / "ks/enclaves"


def speaker(enclaves: Path, token: dict[str, str], pin: str = PIN) -> Participant:
    environment = (*token.items(), ("FASTDDS_PKCS11_PIN", pin))
    return Participant("speaker", enclaves / "speaker", publish=("rt/chatter",), environment=environment)


def test_fast_dds_talks_with_a_key_that_never_leaves_its_token(
    enclaves: Path, token: dict[str, str], domain_id: int, fastdds: Probe
) -> None:
    ear = Participant("ear", enclaves / "ear", subscribe=("rt/chatter",))
    heard, said = fastdds.talk(domain_id, ear, [speaker(enclaves, token)], {"speaker"}, settle=0.2)
    assert heard.voices == {"speaker"}, heard.log + said.log


def test_fast_dds_without_the_pin_does_not_start(
    enclaves: Path, token: dict[str, str], domain_id: int, fastdds: Probe
) -> None:
    answers = fastdds.try_endpoints(domain_id, [speaker(enclaves, token, pin="4321")])
    assert answers.participants == {"speaker": False}


def test_cyclone_dds_has_no_way_to_such_a_key(
    enclaves: Path, token: dict[str, str], domain_id: int, cyclone: Probe
) -> None:
    answers = cyclone.try_endpoints(domain_id, [speaker(enclaves, token)])
    assert answers.participants == {"speaker": False}
