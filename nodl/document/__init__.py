"""NoDL documents, v1 (XML) and v2 (YAML, JSON): text in, ``ManifestNode`` values with places out."""
