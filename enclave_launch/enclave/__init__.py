"""Which enclave each process runs in, and why."""

from enclave_launch.enclave.assignment import (
    AssignmentReason,
    EnclaveAssignment,
    EnclaveScope,
    assign_enclave,
)

__all__ = ["AssignmentReason", "EnclaveAssignment", "EnclaveScope", "assign_enclave"]
