"""API of ``launch_ros.substitutions``. ``TAGS``: the module that registers each ``$(name ...)``."""

from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ExecutableInPackage": "executable_in_package",
        "FindPackage": "find_package",
        "FindPackagePrefix": "find_package",
        "FindPackageShare": "find_package",
        "Parameter": "parameter",
    },
    submodules=("executable_in_package", "find_package", "parameter"),
)

TAGS = {
    "exec-in-pkg": "executable_in_package",
    "find-pkg-prefix": "find_package",
    "find-pkg-share": "find_package",
    "param": "parameter",
}
