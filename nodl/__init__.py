"""NoDL: what a node talks to, from manifests or from its source."""
