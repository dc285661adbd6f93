"""Where a file system has no links: the copies in enclave directories, kept in step with their sources."""

from __future__ import annotations

from keystore.disk import layout, safe_files
from keystore.disk.store import Link, Store
from keystore.disk.view import KeystoreView


def refresh_copies(opened: Store) -> None:
    """Copy trust anchors and the governance again after a change; links need nothing, so this mostly only looks."""
    view = KeystoreView(opened.root)
    stale = [
        (f"{layout.enclave_directory(enclave)}/{name}", target, layout.link_source(name))
        for enclave in view.enclaves()
        for name, target in layout.enclave_links(enclave).items()
    ]
    with opened.batch() as batch:
        for relative, target, source in stale:
            if safe_files.link_target(opened.root, relative) is not None:
                continue
            if safe_files.read_if_there(opened.root, relative) != safe_files.read(opened.root, source):
                batch.link(relative, Link(target, source))
