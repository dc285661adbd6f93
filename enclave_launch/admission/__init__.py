"""What must hold before a process may start secured: nothing on its way takes the enclave away again.

``wrappers``: what stands between us and the program keeps its environment. ``middleware``: its RMW reads enclaves.
``variables``: nothing in its environment turns security off; its DDS domain. The plan asks before anything is signed.
"""

from enclave_launch.admission.admission import AdmissionOptions, notes, prefix_refusals, refusals

__all__ = ["AdmissionOptions", "notes", "prefix_refusals", "refusals"]
