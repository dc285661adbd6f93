"""Which enclave each process runs in, and why."""

from enclave_launch.enclave.assignment import EnclaveAssignment, EnclaveScope, Reason, assign_enclave

__all__ = ["EnclaveAssignment", "EnclaveScope", "Reason", "assign_enclave"]
