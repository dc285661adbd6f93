"""The class ``ParamListener`` that generate_parameter_library makes of a YAML file, as C++ that can be read."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

import yaml

from enclave_common.yaml_reader import load_yaml

_TYPES = {
    "string": "std::string", "double": "double", "int": "int64_t", "bool": "bool",
    "string_array": "std::vector<std::string>", "double_array": "std::vector<double>",
    "int_array": "std::vector<int64_t>", "bool_array": "std::vector<bool>",
}  # fmt: skip
_NAME = re.compile(r"[A-Za-z_]\w*")
_HEADER = """namespace {space} {{
{structures}
class ParamListener {{
public:
  template <typename N> explicit ParamListener(N node, std::string prefix = "") {{ declare(node, prefix); }}
  template <typename N>
  ParamListener(N node, rclcpp::Logger logger, std::string prefix = "") {{ declare(node, prefix); }}
  template <typename N> void declare(N node, std::string prefix) {{
    if (!prefix.empty() && prefix.back() != '.') {{ prefix += "."; }}
{declared}
  }}
  Params get_params() {{ return params_; }}
  bool is_old(const Params & other) const {{ return some_time_later(); }}
  bool try_get_params(Params & params) {{ params = params_; return true; }}
  void refresh_dynamic_parameters() {{}}
  Params params_;
}};
}}
"""


def listener_of(content: str) -> str:
    """Write the header of a file of parameters, as far as their names, types and defaults go.

    The entries of a mapped parameter (``__map_joints``) are not known.

    Raises:
        ValueError: the file is none of the library's.
    """
    try:
        read = load_yaml(content)
    except yaml.YAMLError as error:
        raise ValueError(f"this YAML cannot be read: {error}") from error
    if not isinstance(read, Mapping) or len(read) != 1:
        raise ValueError("a file of parameters has one name at its top")
    ((space, entries),) = read.items()
    if not isinstance(entries, Mapping) or not _NAME.fullmatch(str(space)):
        raise ValueError("a file of parameters has a mapping below its name")
    declared: list[str] = []
    structures = _structure("Params", entries, (), declared)
    return _HEADER.format(space=space, structures=structures, declared="\n".join(declared))


def _structure(
    name: str, entries: Mapping[object, object], path: tuple[str, ...], declared: list[str]
) -> str:
    """Make a ``struct`` with a field for each entry; what the constructor declares goes to ``declared``."""
    fields = []
    for key, entry in ((str(key), entry) for key, entry in entries.items()):
        field = key.removeprefix("__map_") + ("_map" if key.startswith("__map_") else "")
        if not _NAME.fullmatch(field) or not isinstance(entry, Mapping):
            raise ValueError(f"{key} is no parameter and no mapping of parameters")
        if key.startswith("__map_"):
            fields.append(f"std::map<std::string, Entry> {field};")
            declared.append(f"params_.{'.'.join((*path, field))} = entries_that_others_name();")
        elif isinstance(entry.get("type"), str):
            fields.append(f"{_TYPES.get(entry['type'], 'std::string')} {field};")
            default = _default(entry)
            full = ".".join((*path, field))
            declared.append(f'params_.{full} = node->declare_parameter(prefix + "{full}", {default});')
        else:
            inner = _structure(f"{name}_{field}", entry, (*path, field), declared)
            fields.append(f"{inner} {name}_{field} {field};")
    return f"struct {name} {{ {' '.join(fields)} }};"


def _default(entry: Mapping[object, object]) -> str:
    value = entry.get("default_value")
    if "default_value" not in entry or value is None:
        return "rclcpp::PARAMETER_NOT_SET"
    if isinstance(value, list):
        listed = ", ".join(_literal(each) for each in value)
        return f"{_TYPES.get(str(entry['type']), 'std::vector<std::string>')}{{{listed}}}"
    return _literal(value)


def _literal(value: object) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(value).lower() if isinstance(value, bool) else str(value)
