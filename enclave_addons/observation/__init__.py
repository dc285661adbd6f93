"""Observe what runs in a DDS domain and compare it with a plan."""
