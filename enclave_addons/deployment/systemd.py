"""A deployment as systemd units: one service for each process, one target for all.

A unit names where its enclave is; what is there is read at each start. Each service runs as a user of its own and gets
the files of its enclave as credentials (systemd.exec(5)): copied by the manager into memory that only this user reads,
so the keystore stays root's. Credentials are flat; links make the enclave's directory of them. The list of files never
changes: ``SetCredential=`` stands in for a CRL that the keystore does not have (yet, or any more).
Quoting: systemd.syntax(7), systemd.service(5).
"""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Iterator, Mapping

from enclave_addons.deployment.deployment import Deployment, File, one_line
from enclave_addons.deployment.hosts import Needs
from enclave_addons.deployment.processes import DeployedProcess
from enclave_addons.deployment.units import ENCLAVE_KEY, NO_CRL, NODE_KEY
from enclave_launch.dry_run import Respawn
from enclave_launch.security_environment import ENABLE, KEYSTORE, OVERRIDE, STRATEGY
from keystore.disk import layout

_PLAIN = re.compile(r"[A-Za-z0-9_@+=:,./~-]+\Z")
_STOP_SECONDS = 10  # launch sends SIGINT, then SIGTERM after 5 s, then SIGKILL after 5 more
_RESTART_SECONDS = 0.5  # at least: without a pause a process that fails is started some 30 times a second
_NO_MORE_RETRIES = 177
_HOMES = ("/home/", "/root/", "/run/user/")
_EXPIRES_SOON = "14d"
_HARDENING = """\
NoNewPrivileges=yes
CapabilityBoundingSet=
AmbientCapabilities=
ProtectSystem=strict
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
    """Return file name -> file; ``setup``: shell files that set up ROS, sourced before each process."""
    files = {f"{deployment.name}.target": File(_target(deployment))}
    for process in deployment.processes:
        unit = _service(deployment, process, keystore, parameters, setup)
        files[unit_name(deployment, process)] = File(unit)
        files |= deployment.parameter_files(process)
    files[f"{deployment.name}-expiry.service"] = File(_expiry(deployment, keystore, setup))
    files[f"{deployment.name}-expiry.timer"] = File(_timer(deployment))
    return files


def unit_name(deployment: Deployment, process: DeployedProcess) -> str:
    """Return the name of the service."""
    return f"{deployment.name}-{process.name}.service"


def _target(deployment: Deployment) -> str:
    """Return the target, which lists the services in the order of a rolling restart.

    What ends the launch is bound: when it ends the target ends, and with it all that is part of it.
    """
    bound = {one.name for one in deployment.processes if one.entry.process in deployment.ends_launch}
    lines = ["[Unit]", f"Description=ROS 2: {_specifiers(one_line(deployment.source))}"]
    for name in deployment.order:
        unit = f"{deployment.name}-{name}.service"
        lines += [f"BindsTo={unit}", f"After={unit}"] if name in bound else [f"Wants={unit}"]
    lines.append(f"Wants={deployment.name}-expiry.timer")
    return deployment.header() + "\n".join((*lines, "", "[Install]", "WantedBy=multi-user.target", ""))


def _service(
    deployment: Deployment, process: DeployedProcess, keystore: str, parameters: str, setup: tuple[str, ...]
) -> str:
    lines = [
        *_unit_section(deployment, process, keystore),
        "",
        "[Service]",
        "Type=exec",
        "DynamicUser=yes",
        f"SyslogIdentifier={process.name}",
        *_environment(deployment, process),
        *_credentials(process, keystore),
        *_start(deployment, process, keystore, parameters, setup),
        *_restart(process.entry.respawn),
        "",
        *_HARDENING.splitlines(),
        *_home(process, setup),
        *_hardening_of(process.needs),
        "",
    ]
    return deployment.mark() + "\n".join(lines)


def _unit_section(deployment: Deployment, process: DeployedProcess, keystore: str) -> Iterator[str]:
    what = process.shown
    where = f"in enclave {process.enclave}" if process.enclave is not None else "without an enclave"
    yield "[Unit]"
    yield f"Description=ROS 2: {_specifiers(one_line(what))} {where}"
    yield f"# {one_line(process.entry.launch_file)}"
    yield f"{NODE_KEY}={one_line(what)}"
    if process.enclave is not None:
        yield f"{ENCLAVE_KEY}={process.enclave}"
        # Without it a process that is respawned would be started again and again, in vain.
        yield f"AssertPathExists={_specifiers(keystore)}/{layout.source_of(process.enclave, layout.CERT)}"
    yield "Wants=network-online.target time-sync.target"
    yield "After=network-online.target time-sync.target"
    yield f"PartOf={deployment.name}.target"
    yield "StartLimitIntervalSec=0"


def _environment(deployment: Deployment, process: DeployedProcess) -> Iterator[str]:
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


def _credentials(process: DeployedProcess, keystore: str) -> Iterator[str]:
    if process.enclave is None:
        return
    for name in (*layout.RUNTIME_FILES, layout.ENCLAVE_CRL):
        # Behind the keystore's links: systemd takes a stand-in for a missing file, but not for a link that dangles.
        yield f"LoadCredential={name}:{_specifiers(keystore)}/{layout.source_of(process.enclave, name)}"
    yield f"SetCredential={layout.ENCLAVE_CRL}:{NO_CRL}"


def _start(
    deployment: Deployment, process: DeployedProcess, keystore: str, parameters: str, setup: tuple[str, ...]
) -> Iterator[str]:
    unit = unit_name(deployment, process)
    yield f"RuntimeDirectory={unit.removesuffix('.service')}"
    yield "RuntimeDirectoryMode=0700"
    if process.enclave is not None:
        cert = f"{keystore}/{layout.source_of(process.enclave, layout.CERT)}"
        yield "TimeoutStartSec=infinity"
        yield f"ExecStartPre=+/bin/sh -c {quoted(_wait_for_the_clock(cert))}"
        yield f"ExecStartPre=/bin/sh -c {quoted(_link_credentials(process.enclave, keystore))}"
    if _retries(process.entry.respawn) is not None:
        show = f'systemctl show --property=NRestarts --value {unit} > "$RUNTIME_DIRECTORY/restarts"'
        yield f"ExecStartPre=+/bin/sh -c {quoted(f'umask 022; {show}')}"
    if process.entry.cwd is not None:
        yield f"WorkingDirectory={_specifiers(one_line(process.entry.cwd))}"
    script = _script(process, setup)
    words = " ".join(map(quoted, process.words(parameters)))
    yield f"ExecStart=/bin/sh -c {quoted(script)} {process.name} {words}"
    yield "KillSignal=SIGINT"
    yield "SuccessExitStatus=130 SIGINT"
    yield f"TimeoutStopSec={_STOP_SECONDS}"


def _wait_for_the_clock(cert: str) -> str:
    """Return shell words that wait: a board without a battery starts with a clock at which nothing is valid yet."""
    waiting = f"the clock is earlier than the import of {cert}; waiting until it is set"
    return (
        f"imported=$(stat -L -c %Y {shlex.quote(cert)}) || exit 1; "
        '[ "$(date +%s)" -ge "$imported" ] || '
        f"echo {shlex.quote(waiting)} >&2; "
        'until [ "$(date +%s)" -ge "$imported" ]; do sleep 1; done'
    )


def _link_credentials(enclave: str, keystore: str) -> str:
    """Return the script that makes the enclave's directory.

    The stand-in for a CRL is left out. If the manifest of the imported bundle lists a CRL, it was removed: an error. So
    it is that an imported keystore, which is a link to a version, has no manifest.
    """
    crl, manifest = f'"$place/{layout.ENCLAVE_CRL}"', shlex.quote(f"{keystore}/{layout.BUNDLE}")
    lost_manifest, lost_crl = (
        f"echo {shlex.quote(f'{keystore}/{name} was imported and is missing: import the bundle again')} >&2; exit 1"
        for name in (layout.BUNDLE, layout.CRL)
    )
    return (
        f"if [ -L {shlex.quote(keystore)} ] && [ ! -e {manifest} ]; then {lost_manifest}; fi; "
        f'place="$RUNTIME_DIRECTORY"/{shlex.quote(layout.enclave_directory(enclave))} && mkdir -p "$place" && '
        f'ln -sf "$CREDENTIALS_DIRECTORY"/* "$place" && if [ "$(cat {crl})" = {NO_CRL} ]; then '
        f"if grep -qs {layout.CRL} {manifest}; then {lost_crl}; fi; "
        f"rm {crl}; fi"
    )


def _script(process: DeployedProcess, setup: tuple[str, ...]) -> str:
    """Return the script, security last: what sets up ROS cannot take it away."""
    parts = []
    if (retries := _retries(process.entry.respawn)) is not None:
        parts.append(
            f'{{ [ "$(cat "$RUNTIME_DIRECTORY/restarts")" -le {retries} ] || '
            f"{{ echo 'respawned {retries} times, as respawn_max_retries allows' >&2; exit {_NO_MORE_RETRIES}; }}; }}"
        )
    parts += [f". {shlex.quote(file)}" for file in setup]
    exports = [f"{ENABLE}=true", f"{STRATEGY}=Enforce"]
    if process.enclave is not None:
        exports.append(f'{KEYSTORE}="$RUNTIME_DIRECTORY"')
    parts.append(f"export {' '.join(exports)}")
    if process.enclave is None or process.fqn is not None:
        parts.append(f"unset {OVERRIDE}")
    return " && ".join((*parts, 'exec "$@"'))


def _retries(respawn: Respawn | None) -> int | None:
    return respawn.retries if respawn is not None and respawn.retries >= 0 else None


def _restart(respawn: Respawn | None) -> Iterator[str]:
    # ``StartLimitBurst=`` would count manual starts as well, so the process counts by ``NRestarts``.
    if respawn is None:
        yield "Restart=no"
        return
    yield "Restart=always"
    yield f"RestartSec={max(respawn.delay, _RESTART_SECONDS):g}"
    if _retries(respawn) is not None:
        yield f"RestartPreventExitStatus={_NO_MORE_RETRIES}"


def _home(process: DeployedProcess, setup: tuple[str, ...]) -> Iterator[str]:
    """Hide the home directories, but for what the process is started from; that can be read only."""
    folders = home_paths(process, setup)
    yield f"ProtectHome={'tmpfs' if folders else 'yes'}"
    if folders:
        yield f"BindReadOnlyPaths={' '.join(quoted(folder, dollars=False) for folder in folders)}"


def home_paths(process: DeployedProcess, setup: tuple[str, ...]) -> tuple[str, ...]:
    """Return what below home directories the process needs: workspaces, and files named in its command."""
    found: list[str] = []
    for file in setup:
        folder = posixpath.dirname(file)
        # With colcon's --symlink-install the files of install/ are links to src/ and build/ beside it.
        found.append(posixpath.dirname(folder) if posixpath.basename(folder) == "install" else folder)
    found += [word.partition("/lib/")[0] for word in (*process.command, process.entry.cwd or "")]
    below = sorted({one for one in found if f"{one}/".startswith(_HOMES) and one + "/" not in _HOMES})
    return tuple(one for one in below if not any(one.startswith(f"{other}/") for other in below))


def _hardening_of(needs: Needs) -> Iterator[str]:
    if needs.devices:
        yield "PrivateDevices=no"
        yield "DevicePolicy=closed"
        yield from (f"DeviceAllow={device} rw" for device in needs.devices)
    else:
        yield "PrivateDevices=yes"
    if needs.groups:
        yield f"SupplementaryGroups={' '.join(needs.groups)}"
    yield f"MemoryDenyWriteExecute={'no' if needs.writable_code else 'yes'}"
    yield f"RestrictRealtime={'no' if needs.realtime else 'yes'}"
    yield "SystemCallFilter=@system-service"
    yield f"SystemCallFilter=~@privileged{'' if needs.realtime else ' @resources'}"
    if needs.realtime:
        yield "LimitRTPRIO=99"
        yield "LimitMEMLOCK=infinity"
    if needs.memory is not None:
        yield f"MemoryMax={needs.memory.removesuffix('i')}"


def _expiry(deployment: Deployment, keystore: str, setup: tuple[str, ...]) -> str:
    command = ["secure-keystore", "status", keystore, "--expiring-within", _EXPIRES_SOON]
    script = " && ".join((*(f". {shlex.quote(file)}" for file in setup), f"exec {shlex.join(command)}"))
    lines = (
        "[Unit]",
        f"Description=Warn before certificates and permissions in {_specifiers(keystore)} expire",
        f"PartOf={deployment.name}.target",
        "Wants=time-sync.target",
        "After=time-sync.target",
        "",
        "[Service]",
        "Type=oneshot",
        f"SyslogIdentifier={deployment.name}-expiry",
        f"ExecStart=/bin/sh -c {quoted(script)}",
        "",
        *_HARDENING.splitlines(),
        "ProtectHome=read-only",
        *_hardening_of(Needs()),
        "",
    )
    return deployment.mark() + "\n".join(lines)


def _timer(deployment: Deployment) -> str:
    lines = (
        "[Unit]",
        f"Description=Look every day what expires soon for {deployment.name}",
        f"PartOf={deployment.name}.target",
        "",
        "[Timer]",
        "OnActiveSec=1min",
        "OnUnitActiveSec=1d",
        "",
    )
    return deployment.mark() + "\n".join(lines)


def quoted(text: str, *, dollars: bool = True) -> str:
    """Return one word as systemd reads it. ``dollars``: it expands variables there (ExecStart=, not Environment=)."""
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
