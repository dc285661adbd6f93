"""Where a secured launch is kept: in launch's own context, so that several launches in one program stay apart.

Imported in every ``ros2 launch`` of a workspace, secured or not; imports nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.ros2.session import EnclaveSession

KEY = "enclave_launch_session"


def session_of(context: Any) -> EnclaveSession | None:
    """None in a launch that is not secured by us."""
    session: EnclaveSession | None = context.get_locals_as_dict().get(KEY)
    return session
