"""What a command does with an error: one line on stderr and an exit status, no traceback for a user's mistake."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from enclave_launch.boundary.dependencies import missing_dependency
from enclave_launch.errors import EnclaveLaunchError


def guarded(program: str, work: Callable[[], int]) -> int:
    """The exit status of ``work``, or of the error that ended it. What is nobody's mistake but ours is raised."""
    try:
        return work()
    except EnclaveLaunchError as error:
        print(f"{program}: error: {error}", file=sys.stderr)
        return error.exit_status
    except ImportError as error:
        text = missing_dependency(error)
        if text is None:
            raise
        print(f"{program}: error: {text}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
