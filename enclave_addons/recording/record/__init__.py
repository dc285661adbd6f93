"""Records of what nodes requested of librcl: lines in, what each node requested, manifests and comparisons out.

Performs no I/O. ``enclave_addons/recording/recorder.c`` writes the lines; the supervisor adds what it started."""
