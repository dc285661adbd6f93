"""The functions of this room that the rest of the keystore calls (``keystore.add_ons``)."""

from __future__ import annotations

from enclave_addons.zenoh.verification import check_zenoh
from enclave_addons.zenoh.writing import follow, sign
from keystore.add_ons import ZenohFiles

ADD_ON = ZenohFiles(follow, check_zenoh, sign)
