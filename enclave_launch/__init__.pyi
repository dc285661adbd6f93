"""The public names of enclave-launch for type checkers."""

from enclave_launch.enclave import EnclaveScope as EnclaveScope
from enclave_launch.errors import EnclaveLaunchError as EnclaveLaunchError
from enclave_launch.errors import LaunchFileError as LaunchFileError
from enclave_launch.errors import ManifestError as ManifestError
from enclave_launch.errors import ProvisionError as ProvisionError
from enclave_launch.errors import RuntimeFailure as RuntimeFailure
from enclave_launch.flow import evaluate_launch as evaluate_launch
from enclave_launch.flow import find_launch_file as find_launch_file
from enclave_launch.flow import launch_source as launch_source
from enclave_launch.flow import provision as provision
from enclave_launch.flow import resolve as resolve
from enclave_launch.flow import run as run
from enclave_launch.flow import run_async as run_async
from enclave_launch.flow import run_async_unsecured as run_async_unsecured
from enclave_launch.flow import run_unsecured as run_unsecured
from enclave_launch.flow import start as start
from enclave_launch.flow import start_unsecured as start_unsecured
from enclave_launch.options import ResolveOptions as ResolveOptions
from enclave_launch.options import RunSettings as RunSettings
from enclave_launch.options import SecurityOptions as SecurityOptions
from enclave_launch.plan import LaunchPlan as LaunchPlan
from enclave_launch.running import UnsecuredLaunch as UnsecuredLaunch
from enclave_launch.runtime.running_launch import RunningLaunch as RunningLaunch
from enclave_launch.runtime.running_launch import RunningProcess as RunningProcess
from enclave_launch.runtime.running_launch import endpoint_seen as endpoint_seen
from enclave_launch.runtime.running_launch import printed as printed
from enclave_launch.runtime.running_launch import started as started
from enclave_launch.secured import ProvisionedLaunch as ProvisionedLaunch

__version__: str
from enclave_launch.dry_run import DryRun as DryRun
from enclave_launch.errors import UsageError as UsageError
