"""The table ``table.txt``: mistakes of users and what they are answered, in a folder with the files below.

An entry is a command after ``$``, the answer, and the exit status in brackets. ``{here}`` is the folder.

    python -m tests.messages.mistakes      # writes the table again; review what changed before you commit it
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("table.txt")
PROGRAMS = {
    "secure-launch": "enclave_launch.verb.secure_launch",
    "secure-plan": "enclave_addons.review.verb",
    "secure-keystore": "keystore.verb",
    "secure-nodl": "nodl.verb",
}
FILES = {
    "demo.launch.xml": '<launch>\n<arg name="count" default="1"/>\n<node pkg="demo_nodes" exec="talker"/>\n</launch>\n',
    "two.launch.xml": '<launch>\n<node pkg="demo_nodes" exec="talker" launch-prefix="env -i"/>\n'
    '<node pkg="demo_nodes" exec="listener" launch-prefix="env -i"/>\n</launch>\n',
    "unknown.launch.xml": '<launch>\n<node pkg="unknown_driver" exec="driver"/>\n</launch>\n',
    "hosts.yaml": "version: 1\nhosts:\n  a:\n    enclave: [/talker]\n",
    "no_version.yaml": "hosts: {a: {enclaves: [/talker]}}\n",
    "text_for_list.yaml": "version: 1\nhosts: {a: {enclaves: /talker}}\n",
    "governance.yaml": "version: 1\ndomain_rules:\n- {rtps_protection: SIGN}\n",
    "rules.yaml": "accept:\n- {cod: no-server}\n",
    "empty.json": "{}\n",
    "text.json": "talker\n",
    "policy.xml": "<policy/>\n",
    "qos.nodl.yaml": "nodl_version: 2\npublishers:\n- {name: chatter, type: std_msgs/msg/String}\n",
    "history.nodl.yaml": "nodl_version: 2\npublishers:\n- {name: a, type: std_msgs/msg/String, qos: {depth: 1}}\n",
    "good.nodl.yaml": "nodl_version: 2\n",
    "root.nodl.xml": "<nodes/>\n",
    "broken.py": "def f(:\n",
    "stuff/file": "x\n",
    "project/enclaves.yaml": "keystor: ks\n",
}
VARIABLES = (
    "ROS_SECURITY_KEYSTORE",
    "ROS_DISTRO",
    "ROS_DOMAIN_ID",
    "AMENT_PREFIX_PATH",
    "RMW_IMPLEMENTATION",
    "NO_COLOR",
)


@dataclass(frozen=True)
class Mistake:
    """An entry of the table."""

    command: str
    answer: str
    status: int


def entries() -> Iterator[Mistake]:
    """Yield the entries of the table."""
    for block in re.split(r"^\$ ", TABLE.read_text(encoding="utf-8"), flags=re.M)[1:]:
        command, _, rest = block.partition("\n")
        answer, _, status = rest.rstrip().rpartition("[")
        yield Mistake(command, answer, int(status.rstrip("]")))


def make_folder(folder: Path) -> None:
    """Write the files, and a keystore ``ks`` with the enclave ``/talker``."""
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    for words in (("create", "-q", "ks"), ("create-enclave", "-q", "ks", "/talker")):
        answer = answered(
            ["secure-keystore", *(str(folder / each) if each == "ks" else each for each in words)]
        )
        assert answer.status == 0, answer
    (folder / "ws").symlink_to(ROOT / "fixtures" / "demo_ws")


def answered(words: list[str]) -> Mistake:
    """Run a command in this process and return what it prints."""
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
        try:
            status = import_module(PROGRAMS[words[0]]).main(words[1:])
        except SystemExit as ended:
            status = ended.code
    text = shown.getvalue().replace(os.getcwd(), "{here}").replace(str(ROOT), "{project}")
    return Mistake(shlex.join(words), text, int(status or 0))


def main() -> None:
    """Write the table again, with the commands that it has."""
    for name in VARIABLES:
        os.environ.pop(name, None)
    os.environ["COLUMNS"] = "200"
    written = []
    for entry in list(entries()):
        with tempfile.TemporaryDirectory() as name:
            make_folder(Path(name))
            os.chdir(name)
            found = answered(shlex.split(entry.command))
            os.chdir(ROOT)
            shutil.rmtree(name, ignore_errors=True)
            os.makedirs(name)
        written.append(f"$ {entry.command}\n{found.answer}[{found.status}]\n")
    TABLE.write_text("\n".join(written), encoding="utf-8")


if __name__ == "__main__":
    main()
