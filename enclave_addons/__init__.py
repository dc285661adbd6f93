"""Add-ons of enclave-launch: each room works on what the core decides, and the core works without any of them."""
