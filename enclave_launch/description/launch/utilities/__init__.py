"""``launch.utilities``."""

from enclave_launch.description.launch.utilities.basics import (
    ensure_argument_type,
    is_a,
    is_a_subclass,
    isclassinstance,
    normalize_to_list_of_entities,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "AsyncSafeSignalManager": "signal_management",
        "create_future": "create_future_impl",
        "visit_all_entities_and_collect_futures": "visit_all_entities_and_collect_futures_impl",
    },
    submodules=("type_utils", "typing_file_path"),
)
__all__ = [
    "AsyncSafeSignalManager",
    "create_future",
    "ensure_argument_type",
    "is_a",
    "is_a_subclass",
    "isclassinstance",
    "normalize_to_list_of_entities",
    "normalize_to_list_of_substitutions",
    "perform_substitutions",
    "visit_all_entities_and_collect_futures",
]
