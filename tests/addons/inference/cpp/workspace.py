"""Small C++ packages for the tests: a program is written as its author would, and read through ``infer_paths``."""

from __future__ import annotations

from pathlib import Path

from enclave_addons.inference import InferredSystem, infer_paths
from nodl.node_interface import NodeInterface

HEAD = "#include <rclcpp/rclcpp.hpp>\n"


def package(
    folder: Path, files: dict[str, str], cmake: str = "", depends: tuple[str, ...] = ("rclcpp",)
) -> Path:
    """A package of the folder's name; without ``cmake`` every ``.cpp`` below ``src`` is one executable ``node``."""
    sources = " ".join(name for name in files if name.startswith("src/") and name.endswith(".cpp"))
    listed = "".join(f"<depend>{each}</depend>" for each in depends)
    write(folder / "package.xml", f"<package><name>{folder.name}</name>{listed}</package>")
    write(
        folder / "CMakeLists.txt", f"project({folder.name})\n{cmake or f'add_executable(node {sources})'}\n"
    )
    for name, source in files.items():
        write(folder / name, source)
    return folder


def write(path: Path, content: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content, encoding="utf-8")


def in_class(body: str, members: str = "", before: str = "") -> str:
    """A program with one node ``n`` whose constructor is ``body``."""
    return f"""{HEAD}{before}
class Demo : public rclcpp::Node {{
public:
  Demo() : Node("n") {{ {body} }}
{members}
}};
int main(int argc, char ** argv) {{
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<Demo>());
}}
"""


def infer(folder: Path, source: str, **more: str) -> InferredSystem:
    """The program of one source file; ``more``: further files by name, ``__`` for a slash and ``_h`` for ``.hpp``."""
    files = {"src/main.cpp": source, **{_path(name): text for name, text in more.items()}}
    return infer_paths([package(folder / "demo", files)])


def _path(name: str) -> str:
    return name.replace("__", "/").replace("_hpp", ".hpp").replace("_cpp", ".cpp")


def endpoints(system: InferredSystem) -> set[tuple[str, str]]:
    """Kind and name, as the source writes it, over all nodes."""
    return {(e.kind.value, str(e.name)) for node in system.nodes for e in node.endpoints}


def names(system: InferredSystem) -> list[str]:
    return sorted(str(e.name) for node in system.nodes for e in node.endpoints)


def gaps(system: InferredSystem) -> list[str]:
    """Why something is not known, of nodes and of nobody."""
    return [gap.why for node in system.nodes for gap in node.gaps] + [gap.why for gap in system.gaps]


def node(system: InferredSystem, name: str) -> NodeInterface:
    (found,) = (each for each in system.nodes if each.name == name)
    return found
