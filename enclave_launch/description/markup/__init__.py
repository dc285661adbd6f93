"""XML and YAML: text in, actions and substitutions out (API of ``launch.frontend``)."""
