"""A workspace whose nodes are on real Zenoh: they do with their environment what rmw_zenoh_cpp and rcl do.

``rmw_zenohd`` is a session of eclipse-zenoh in mode ``router`` that reads its file as rmw_zenohd does.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.addons.zenoh import kit
from tests.programs import install_package, python_program

ROUTER = """
import os, signal, threading, zenoh
over = threading.Event()
signal.signal(signal.SIGINT, lambda *_: over.set())
zenoh.try_init_log_from_env()
print("router begins", flush=True)
session = zenoh.open(zenoh.Config.from_file(os.environ["ZENOH_ROUTER_CONFIG_URI"]))
over.wait()
os._exit(0)
"""

NODE = """
import os, sys, time, zenoh
config = zenoh.Config.from_file(os.environ["ZENOH_SESSION_CONFIG_URI"])
for pair in filter(None, os.environ.get("ZENOH_CONFIG_OVERRIDE", "").split(";")):
    config.insert_json5(*pair.split("=", 1))
enclave = sys.argv[sys.argv.index("--enclave") + 1]
domain = os.environ.get("ROS_DOMAIN_ID") or "0"
session = zenoh.open(config)
print("mode", config.get_json("mode"), "enclave", enclave, flush=True)
def key(name, type_name="std_msgs::msg::dds_::String_"):
    return f"{domain}/{name}/{type_name}/RIHS01_0"
def until(condition, patience=20.0):
    end = time.monotonic() + patience
    while not condition() and time.monotonic() < end:
        time.sleep(0.005)
    return bool(condition())
"""
TALKER = (
    NODE
    + """
while True:
    session.put(key("secret"), "secret")
    session.put(key("chatter", "std_msgs::msg::dds_::Int32_"), "another type")
    session.put(key("chatter"), "hello")
    time.sleep(0.01)
"""
)
LISTENER = (
    NODE
    + """
heard = []
kept = [session.declare_subscriber(k, lambda sample: heard.append(sample.payload.to_string()))
        for k in (key("chatter"), key("chatter", "std_msgs::msg::dds_::Int32_"), key("secret"))]
came = until(lambda: heard.count("hello") >= 3)
print("heard", sorted(set(heard)), flush=True)
os._exit(0 if came else 1)
"""
)

MANIFEST = """<interface version="1">
  <node name="talker" executable="talker"><topic name="chatter" type="std_msgs/msg/String" role="publisher"/></node>
  <node name="listener" executable="listener">
    <topic name="chatter" type="std_msgs/msg/String" role="subscription"/>
  </node>
</interface>
"""
TALKER_AND_LISTENER = """<launch>
  <set_env name="RMW_IMPLEMENTATION" value="rmw_zenoh_cpp"/>
  <node pkg="zenoh_nodes" exec="talker" name="talker" enclave="/talker">{talker}</node>
  <node pkg="zenoh_nodes" exec="listener" name="listener" enclave="/listener" on_exit="shutdown" output="screen"/>
</launch>
"""


def install_router(prefix: Path) -> None:
    install_package(prefix, "rmw_zenoh_cpp", {"rmw_zenohd": python_program(ROUTER)})


class Workspace:
    """``router``: whether rmw_zenohd is installed in it."""

    def __init__(self, root: Path, *, router: bool = True):
        self.root = root
        self.prefix = root / "install"
        self.keystore = root / "ks"
        if router:
            install_router(self.prefix)
        programs = {"talker": python_program(TALKER), "listener": python_program(LISTENER)}
        share = install_package(self.prefix, "zenoh_nodes", programs)
        (share / "zenoh_nodes.nodl.xml").write_text(MANIFEST)

    def launch_file(self, talker: str = "", text: str = TALKER_AND_LISTENER) -> Path:
        file = self.root / "test.launch.xml"
        file.write_text(text.format(talker=talker))
        return file

    def at_a_free_port(self) -> str:
        """A keystore whose router is where no other test has one."""
        address = f"localhost:{kit.free_port()}"
        self.keystore_command("create")
        self.keystore_command("zenoh", "--router", address)
        return address

    def keystore_command(self, verb: str, *words: str) -> str:
        """Output of ``secure-keystore VERB KEYSTORE ...``, which must succeed."""
        done = subprocess.run(
            [sys.executable, "-m", "keystore.verb", verb, str(self.keystore), *words],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout
        return done.stdout

    def secure_launch(self, *words: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
        text = ("--secure", "--keystore", self.keystore, "--prefix", self.prefix, "--distro", "jazzy", *words)
        environment = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("ROS_", "RMW_", "ZENOH_"))
        }
        return subprocess.run(
            [sys.executable, "-m", "enclave_launch", *map(str, text)],
            env={**environment, "ROS_LOG_DIR": str(self.root / "log"), **variables},
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            timeout=90, check=False,
        )  # fmt: skip
