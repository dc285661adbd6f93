"""A deployment as systemd units: one service for each process, one target for all. Pure.

Each service runs as a user of its own, and gets exactly the files of its enclave as credentials (systemd.exec(5)):
copied by the manager into memory that only this user reads, so the keystore stays root's. Credentials are flat; one
link makes the enclave's directory of them. Quoting: systemd.syntax(7), systemd.service(5).
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping

from enclave_launch.deployment.deployment import Deployment, File, one_line, runtime_names, source_of
from enclave_launch.deployment.processes import DeployedProcess
from enclave_launch.security_environment import ENABLE, KEYSTORE, OVERRIDE, STRATEGY
from keystore.disk import layout
from keystore.formats.hosts import Needs

_PLAIN = re.compile(r"[A-Za-z0-9_@+=:,./~-]+\Z")
_STOP_SECONDS = 10  # launch sends SIGINT, then SIGTERM after 5 s, then SIGKILL after 5 more
_HARDENING = """\
NoNewPrivileges=yes
CapabilityBoundingSet=
AmbientCapabilities=
ProtectSystem=strict
ProtectHome=yes
PrivateTmp=yes
ProtectProc=invisible
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
ProtectClock=yes
ProtectHostname=yes
RestrictAddressFamilies=AF_INET AF_INET6 AF_UNIX AF_NETLINK
RestrictNamespaces=yes
RestrictSUIDSGID=yes
LockPersonality=yes
RemoveIPC=yes
SystemCallArchitectures=native
SystemCallErrorNumber=EPERM
UMask=0077
LimitCORE=0
"""


def systemd_files(
    deployment: Deployment, *, keystore: str, parameters: str, setup: tuple[str, ...] = ()
) -> dict[str, File]:
    """File name -> file. ``keystore``: where bundles are imported on the host; ``parameters``: where the generated
    parameter files are installed; ``setup``: shell files that set up ROS, sourced before each process."""
    files = {f"{deployment.name}.target": File(_target(deployment))}
    for process in deployment.processes:
        unit = _service(deployment, process, keystore, parameters, setup)
        files[unit_name(deployment, process)] = File(unit)
        files |= deployment.parameter_files(process)
    files["rolling-restart"] = File(_rolling_restart(deployment), 0o755)
    return files


def unit_name(deployment: Deployment, process: DeployedProcess) -> str:
    """Of the service."""
    return f"{deployment.name}-{process.name}.service"


def _target(deployment: Deployment) -> str:
    """What ends the launch is bound: when it ends the target ends, and with it all that is part of it."""
    lines = ["[Unit]", f"Description=ROS 2: {_specifiers(one_line(deployment.source))}"]
    for process in deployment.processes:
        unit = unit_name(deployment, process)
        bound = process.process in deployment.ends_launch
        lines += [f"BindsTo={unit}", f"After={unit}"] if bound else [f"Wants={unit}"]
    return deployment.header() + "\n".join((*lines, "", "[Install]", "WantedBy=multi-user.target", ""))


def _service(
    deployment: Deployment, process: DeployedProcess, keystore: str, parameters: str, setup: tuple[str, ...]
) -> str:
    lines = [
        *_unit_section(deployment, process),
        "",
        "[Service]",
        "Type=exec",
        "DynamicUser=yes",
        *_environment(deployment, process),
        *_credentials(deployment, process, keystore),
        *_start(deployment, process, parameters, setup),
        *_restart(process),
        "",
        *_HARDENING.splitlines(),
        *_hardening_of(process.needs),
        "",
        "[Install]",
        f"WantedBy={deployment.name}.target",
        "",
    ]
    return deployment.header() + "\n".join(lines)


def _unit_section(deployment: Deployment, process: DeployedProcess) -> Iterator[str]:
    what = process.fqn or process.process
    where = f"in enclave {process.enclave}" if process.enclave is not None else "without an enclave"
    yield "[Unit]"
    yield f"Description=ROS 2: {_specifiers(one_line(what))} {where}"
    yield f"# {one_line(process.place)}"
    yield "Wants=network-online.target"
    yield "After=network-online.target time-sync.target"
    yield f"PartOf={deployment.name}.target"
    if process.respawn is not None and process.respawn.retries >= 0:
        yield "StartLimitIntervalSec=infinity"
        yield f"StartLimitBurst={process.respawn.retries + 1}"
    else:
        yield "StartLimitIntervalSec=0"


def _environment(deployment: Deployment, process: DeployedProcess) -> Iterator[str]:
    """The keystore is known only when the unit starts, see ``_start``."""
    folder = unit_name(deployment, process).removesuffix(".service")
    variables: Mapping[str, str] = process.variables("")
    if process.enclave is not None:
        variables = {name: text for name, text in variables.items() if name != KEYSTORE}
    for name, text in variables.items():
        yield f"Environment={quoted(f'{name}={text}', dollars=False)}"
    yield f"Environment=HOME=%S/{folder} ROS_HOME=%S/{folder} ROS_LOG_DIR=%L/{folder} TZ=UTC"
    if OVERRIDE not in variables:
        yield f"UnsetEnvironment={OVERRIDE}"
    yield f"StateDirectory={folder}"
    yield f"LogsDirectory={folder}"


def _credentials(deployment: Deployment, process: DeployedProcess, keystore: str) -> Iterator[str]:
    material = deployment.enclave_of(process)
    if material is None:
        return
    for name in runtime_names(material):
        yield f"LoadCredential={name}:{_specifiers(keystore)}/{source_of(material, name)}"
    yield f"RuntimeDirectory={unit_name(deployment, process).removesuffix('.service')}"
    yield "RuntimeDirectoryMode=0700"


def _start(
    deployment: Deployment, process: DeployedProcess, parameters: str, setup: tuple[str, ...]
) -> Iterator[str]:
    if process.enclave is not None:
        place = layout.enclave_directory(process.enclave)
        above = place.rpartition("/")[0]
        # The root enclave's directory is enclaves/ itself.
        make = f'mkdir -p "$RUNTIME_DIRECTORY/{above}" && ' if above else ""
        link = f'ln -sfn "$CREDENTIALS_DIRECTORY" "$RUNTIME_DIRECTORY/{place}"'
        yield f"ExecStartPre=/bin/sh -c {quoted(make + link)}"
    if process.cwd is not None:
        yield f"WorkingDirectory={_specifiers(one_line(process.cwd))}"
    script = _script(process, setup)
    words = " ".join(map(quoted, process.words(parameters)))
    yield f"ExecStart=/bin/sh -c {quoted(script)} {process.name} {words}"
    yield "KillSignal=SIGINT"
    yield "SuccessExitStatus=130 SIGINT"
    yield f"TimeoutStopSec={_STOP_SECONDS}"


def _script(process: DeployedProcess, setup: tuple[str, ...]) -> str:
    """Security last: what sets up ROS cannot take it away."""
    parts = [f". {shlex.quote(file)}" for file in setup]
    exports = [f"{ENABLE}=true", f"{STRATEGY}=Enforce"]
    if process.enclave is not None:
        exports.append(f'{KEYSTORE}="$RUNTIME_DIRECTORY"')
    parts.append(f"export {' '.join(exports)}")
    if process.enclave is None or process.fqn is not None:
        parts.append(f"unset {OVERRIDE}")
    return " && ".join((*parts, 'exec "$@"'))


def _restart(process: DeployedProcess) -> Iterator[str]:
    """As the launch file says; a refused process is not started again and again unless it says so."""
    if process.respawn is None:
        yield "Restart=no"
        return
    yield "Restart=always"
    yield f"RestartSec={process.respawn.delay:g}"


def _hardening_of(needs: Needs) -> Iterator[str]:
    """What the hosts file says that the process needs is left open, nothing else."""
    if needs.devices:
        yield "PrivateDevices=no"
        yield "DevicePolicy=closed"
        yield from (f"DeviceAllow={device} rw" for device in needs.devices)
    else:
        yield "PrivateDevices=yes"
    yield f"MemoryDenyWriteExecute={'no' if needs.writable_code else 'yes'}"
    yield f"RestrictRealtime={'no' if needs.realtime else 'yes'}"
    yield "SystemCallFilter=@system-service"
    yield f"SystemCallFilter=~@privileged{'' if needs.realtime else ' @resources'}"
    if needs.realtime:
        yield "LimitRTPRIO=99"
        yield "LimitMEMLOCK=infinity"
    if needs.memory is not None:
        yield f"MemoryMax={needs.memory.removesuffix('i')}"


def _rolling_restart(deployment: Deployment) -> str:
    """For new certificates or permissions: sources before what they influence, one at a time."""
    units = [f"{deployment.name}-{name}.service" for name in deployment.order]
    lines = (
        "#!/bin/sh",
        deployment.header().rstrip("\n"),
        "# Restart what runs, one after the other, sources first; stops at the first that does not come up again.",
        "# With names of units as arguments only those, in this order.",
        "set -eu",
        "for unit in \\",
        *(f"    {unit} \\" for unit in units),
        "; do",
        '    [ $# -eq 0 ] || case " $* " in *" $unit "*) ;; *) continue ;; esac',
        '    systemctl is-active --quiet "$unit" || continue',
        '    systemctl restart "$unit"',
        "    sleep 2",
        '    systemctl is-active --quiet "$unit" || { echo "$unit did not come up again" >&2; exit 1; }',
        "done",
        "",
    )
    return "\n".join(lines)


def quoted(text: str, *, dollars: bool = True) -> str:
    """One word as systemd reads it; ``dollars``: where it expands variables (ExecStart=, not Environment=)."""
    escaped = _specifiers(text)
    if dollars:
        escaped = escaped.replace("$", "$$")
    if _PLAIN.match(escaped):
        return escaped
    escaped = escaped.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{"".join(char if char.isprintable() else _escape(char) for char in escaped)}"'


def _escape(char: str) -> str:
    return "".join(f"\\x{byte:02x}" for byte in char.encode())


def _specifiers(text: str) -> str:
    return text.replace("%", "%%")
