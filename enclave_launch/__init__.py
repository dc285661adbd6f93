"""enclave-launch: a launch file in, secured processes out."""

__version__ = "0.1.0"
