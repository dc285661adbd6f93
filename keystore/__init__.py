"""SROS2 keystores: certificates, governance, permissions, and the policy they follow."""
