"""enclave-launch: a launch file in, secured processes out.

``resolve`` → ``LaunchPlan`` → ``provision`` → ``ProvisionedLaunch`` → ``run``; see ``enclave_launch.flow``.
The public names are listed in ``__init__.pyi``; each is imported when first used, so that ``import enclave_launch``
costs nothing.
"""

from __future__ import annotations

from enclave_launch.boundary import VERSION
from enclave_launch.boundary.public_names import public_names

__version__ = VERSION
__getattr__, __dir__ = public_names(__name__, __file__)
