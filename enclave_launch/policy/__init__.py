"""From nodes to least privilege: interfaces under final names -> one policy per launch, with reasons."""

from enclave_launch.policy.derivation import DerivedPolicy, derive_policy
from enclave_launch.policy.node_permissions import PolicyOptions
from enclave_launch.policy.running_node import RunningNode

__all__ = ["DerivedPolicy", "PolicyOptions", "RunningNode", "derive_policy"]
