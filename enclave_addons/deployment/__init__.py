"""From a plan to what runs processes on robots: systemd units, a Compose file, Kubernetes objects."""
